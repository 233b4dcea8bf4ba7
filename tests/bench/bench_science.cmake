# SPDX-License-Identifier: MIT
add_executable(bench_science EXCLUDE_FROM_ALL science/main.cpp science/simulated.cpp
  science/passes.cpp science/outliers.cpp
  science/cycles.cpp science/designs.cpp science/cost.cpp science/lag.cpp science/intervals.cpp science/siblings.cpp science/real.cpp science/rest.cpp science/monitor.cpp science/contenders.cpp
  science/record.cpp)
target_link_libraries(bench_science PRIVATE prism_evaluation prism_training prismcal_design prism_simulation Boost::headers fmt::fmt)
add_dependencies(benchmarks bench_science)
