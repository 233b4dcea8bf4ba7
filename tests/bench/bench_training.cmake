# SPDX-License-Identifier: MIT
add_executable(bench_training EXCLUDE_FROM_ALL training_bench.cpp)
target_link_libraries(bench_training PRIVATE prism_training nlohmann_json::nlohmann_json fmt::fmt)
target_compile_definitions(bench_training PRIVATE PRISM_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
set_source_files_properties(training_bench.cpp PROPERTIES COMPILE_OPTIONS "-O2")
# References built for this machine: the bare sum and Eigen's own factor, as a lower bound.
add_library(bench_native OBJECT EXCLUDE_FROM_ALL training_native.cpp)
target_link_libraries(bench_native PRIVATE Eigen3::Eigen)
target_compile_options(bench_native PRIVATE -O3 -march=native -DNDEBUG)
target_link_libraries(bench_training PRIVATE bench_native)
add_dependencies(benchmarks bench_training)
