# SPDX-License-Identifier: MIT
# The frame decoder alone, in memory.
add_executable(bench_wire EXCLUDE_FROM_ALL wire_bench.cpp)
target_link_libraries(bench_wire PRIVATE prism_clock prism_wire)
add_dependencies(benchmarks bench_wire)
