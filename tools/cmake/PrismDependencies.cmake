# SPDX-License-Identifier: MIT
# Libraries of Debian 12 and 13; tools/setup installs them.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Boost 1.81 REQUIRED CONFIG)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(tl-expected REQUIRED)
find_package(CLI11 REQUIRED)
if(PRISM_WEB)
endif()
find_package(utf8cpp REQUIRED)
if(NOT TARGET utf8cpp::utf8cpp)  # utfcpp 3, Debian 12
  add_library(utf8cpp::utf8cpp ALIAS utf8cpp)
endif()
pkg_check_modules(PCAP REQUIRED IMPORTED_TARGET libpcap)
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd)
pkg_check_modules(NETTLE REQUIRED IMPORTED_TARGET nettle)

# Asio and the other header-only parts of Boost; files include narrow headers.
add_library(prism_boost INTERFACE)
target_link_libraries(prism_boost INTERFACE Boost::headers Threads::Threads)
target_compile_definitions(prism_boost INTERFACE BOOST_ASIO_NO_DEPRECATED)
