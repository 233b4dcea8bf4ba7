# SPDX-License-Identifier: MIT
# Compiler settings of all targets, and options for programs other than prismd, prismctl and prismsim; each of them
# needs further libraries (CONTRIBUTING.md).
option(PRISM_CAL "Build prismcal" ON)
option(PRISM_RELAY "Build prismrelay" ON)
option(PRISM_WEB "Build prismweb" ON)
if(PRISM_CAL AND PRISM_RELAY AND PRISM_WEB)
  set(PRISM_EVERYTHING ON)
else()
  set(PRISM_EVERYTHING OFF)
endif()
option(PRISM_CCACHE "Compile through ccache if it is installed" OFF)
option(PRISM_HARDENING "Harden optimised builds; OFF for a packager whose own flags do" ON)
option(PRISM_WARNINGS "Let the compiler warn" ON)
option(PRISM_WERROR "Treat warnings as errors" OFF)
set(PRISM_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them: address,undefined or thread")
option(PRISM_COVERAGE "Instrument for gcov" OFF)
option(PRISM_FUZZ "Sanitizers and the libFuzzer targets (clang only)" OFF)
option(PRISM_UNITY "Compile several files of a room at once: everything is built sooner, a change later" OFF)
set(PRISM_UNITY_FILES 40 CACHE STRING "Files of one unit: 40 is fastest for a first build, 12 compiles less after a change")

# Default: the build that a user would install.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Debug, Release, RelWithDebInfo or MinSizeRel" FORCE)
endif()

if(PRISM_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(CCACHE ccache)
  if(CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  endif()
endif()

# The date of man pages and changelogs: from the environment, else of the last commit.
set(PRISM_EPOCH $ENV{SOURCE_DATE_EPOCH})
if(NOT PRISM_EPOCH)
  execute_process(COMMAND git -C ${CMAKE_SOURCE_DIR} log -1 --format=%ct
    OUTPUT_VARIABLE PRISM_EPOCH OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT PRISM_EPOCH)
  set(PRISM_EPOCH 0)
endif()

add_library(prism_settings INTERFACE)
target_include_directories(prism_settings INTERFACE ${CMAKE_SOURCE_DIR})
# No automatic fused multiply-add, so that a capture gives the same log on every machine.
target_compile_options(prism_settings INTERFACE -ffp-contract=off)
if(PRISM_WARNINGS)
  target_compile_options(prism_settings INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion)
endif()
# A unity build of a module takes 10 % less time if g++ may use 2 GB before it collects garbage.
if(PRISM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  cmake_host_system_information(RESULT memory_mib QUERY TOTAL_PHYSICAL_MEMORY)
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  math(EXPR memory_mib_a_core "${memory_mib} / ${cores}")
  if(memory_mib_a_core GREATER 4000)
    target_compile_options(prism_settings INTERFACE "SHELL:--param ggc-min-expand=100" "SHELL:--param ggc-min-heapsize=1048576")
  endif()
endif()
# Programs do not load libraries that they do not use.
target_link_options(prism_settings INTERFACE LINKER:--as-needed)
if(PRISM_WERROR)
  target_compile_options(prism_settings INTERFACE -Werror)
endif()
if(CMAKE_BUILD_TYPE STREQUAL Release)  # the same binary from any build directory
  target_compile_options(prism_settings INTERFACE
    -ffile-prefix-map=${CMAKE_BINARY_DIR}=build -ffile-prefix-map=${CMAKE_SOURCE_DIR}=.)
endif()
if(PRISM_SANITIZE)
  # With a sanitizer, g++ 12 wrongly reports uninitialised optionals.
  target_compile_options(prism_settings INTERFACE -Wno-maybe-uninitialized)
  target_compile_options(prism_settings INTERFACE -fsanitize=${PRISM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(prism_settings INTERFACE -fsanitize=${PRISM_SANITIZE})
  if(PRISM_SANITIZE STREQUAL thread)
    # Asio uses atomic_thread_fence, which the thread sanitizer does not support: g++ warns in each file that includes
    # it.
    target_compile_options(prism_settings INTERFACE -Wno-tsan)
  endif()
endif()
if(PRISM_FUZZ)  # the libraries, too: libFuzzer needs their coverage
  # clang 14 cannot compile coroutines with -fsanitize=function.
  target_compile_options(prism_settings INTERFACE -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=function
    -fno-sanitize-recover=all)
  target_link_options(prism_settings INTERFACE -fsanitize=address,undefined)
endif()
# All optimised builds are hardened, with or without a preset; tests/hardening.py checks the binaries. Not with
# sanitizers: FORTIFY would hide their checks.
if(PRISM_HARDENING AND NOT PRISM_SANITIZE AND NOT PRISM_FUZZ)
  include(CheckCXXCompilerFlag)
  set(hardening -fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
  foreach(flag -fcf-protection=full -fstack-clash-protection -mbranch-protection=standard)
    string(MAKE_C_IDENTIFIER "PRISM_HAS${flag}" known)
    check_cxx_compiler_flag(${flag} ${known})
    if(${known})
      list(APPEND hardening ${flag})
    endif()
  endforeach()
  set(optimised $<CONFIG:Release,RelWithDebInfo,MinSizeRel>)
  set(program $<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>)
  set(library_code $<BOOL:$<TARGET_PROPERTY:POSITION_INDEPENDENT_CODE>>)
  target_compile_options(prism_settings INTERFACE
    "$<${optimised}:${hardening}>" "$<$<AND:${optimised},$<NOT:${library_code}>>:-fPIE>")
  target_link_options(prism_settings INTERFACE
    "$<${optimised}:LINKER:-z,relro,-z,now,-z,noexecstack>" "$<$<AND:${optimised},${program}>:-pie>")
endif()
if(PRISM_COVERAGE)
  target_compile_options(prism_settings INTERFACE --coverage -fprofile-update=atomic)
  target_link_options(prism_settings INTERFACE --coverage)
endif()

# prism_room(NAME SOURCES a.cpp ... [LINK lib ...] [WITH NAME] [FAST]): one static library (module) with the project's
# settings. A unity build joins up to PRISM_UNITY_FILES, which takes less memory than more of them, and both cores; WITH another
# module, also files of both, if all users link both, which saves compiling shared headers twice. FAST: fewer
# optimisation passes, two thirds of the compile time; for code that runs once (command lines, text output) or leaves long
# loops to the kernels' library.
function(prism_room name)
  cmake_parse_arguments(ROOM "FAST" "WITH" "SOURCES;LINK" ${ARGN})
  if(PRISM_UNITY AND ROOM_WITH)
    list(TRANSFORM ROOM_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    target_sources(${ROOM_WITH} PRIVATE ${ROOM_SOURCES})
    set_property(TARGET ${ROOM_WITH} APPEND PROPERTY PRISM_ROOMS ${ROOM_WITH} ${name})
    get_target_property(joined ${ROOM_WITH} PRISM_ROOMS)
    list(REMOVE_ITEM ROOM_LINK ${joined})
    target_link_libraries(${ROOM_WITH} PUBLIC ${ROOM_LINK})
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${ROOM_WITH})
    return()
  endif()
  add_library(${name} STATIC ${ROOM_SOURCES})
  target_link_libraries(${name} PUBLIC prism_settings ${ROOM_LINK})
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${PRISM_UNITY} UNITY_BUILD_BATCH_SIZE ${PRISM_UNITY_FILES})
  if(ROOM_FAST)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
endfunction()
