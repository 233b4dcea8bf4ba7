# SPDX-License-Identifier: MIT
add_executable(bench_table EXCLUDE_FROM_ALL table_bench.cpp)
target_link_libraries(bench_table PRIVATE prismcal_tables fmt::fmt)
add_dependencies(benchmarks bench_table)
