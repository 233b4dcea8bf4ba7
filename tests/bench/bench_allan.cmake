# SPDX-License-Identifier: MIT
add_executable(bench_allan EXCLUDE_FROM_ALL allan_bench.cpp)
target_link_libraries(bench_allan PRIVATE prism_evaluation fmt::fmt)
add_dependencies(benchmarks bench_allan)
add_executable(bench_allan_coverage EXCLUDE_FROM_ALL allan_coverage.cpp)
target_link_libraries(bench_allan_coverage PRIVATE prism_evaluation fmt::fmt)
add_dependencies(benchmarks bench_allan_coverage)
