# SPDX-License-Identifier: MIT
# Cross-compiles for arm64 on Debian: `tools/setup arm64` installs the compiler, the emulator and the libraries of the
# root.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

get_filename_component(PRISM_ARM64_ROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/arm64-root" ABSOLUTE)
set(CMAKE_SYSROOT ${PRISM_ARM64_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# pkg-config finds only the root's libraries; these variables are used during configuration.
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${PRISM_ARM64_ROOT})
set(ENV{PKG_CONFIG_LIBDIR} "${PRISM_ARM64_ROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${PRISM_ARM64_ROOT}/usr/share/pkgconfig")

# Tests run under the emulator, with the root's dynamic linker and libraries.
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;${PRISM_ARM64_ROOT}")
