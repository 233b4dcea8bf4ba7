# SPDX-License-Identifier: MIT
# Captures and the simulated gyro.
find_package(benchmark REQUIRED)
add_executable(bench_capture EXCLUDE_FROM_ALL capture_bench.cpp)
target_link_libraries(bench_capture PRIVATE prism_drivers prism_simulation benchmark::benchmark)
target_compile_definitions(bench_capture PRIVATE PRISM_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
add_dependencies(benchmarks bench_capture)
