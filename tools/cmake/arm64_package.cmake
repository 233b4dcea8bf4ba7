# SPDX-License-Identifier: MIT
# Read by cpack: dpkg-shlibdeps takes the dependencies from the packages of build/arm64-root, not from those of the
# machine.
set(ENV{DEB_HOST_ARCH} arm64)
get_filename_component(database "${CMAKE_CURRENT_LIST_DIR}/../../build/arm64-root/var/lib/dpkg" ABSOLUTE)
set(ENV{DPKG_ADMINDIR} ${database})
