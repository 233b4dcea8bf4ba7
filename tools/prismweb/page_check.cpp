// SPDX-License-Identifier: MIT
#include "tools/prismweb/page_check.hpp"

#include <sqlite3.h>

#include <boost/crc.hpp>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace prism::prismweb {
namespace {

constexpr int kPageBytes = 4096;  // SQLite's default

// SQLite allocates szOsFile bytes: a CheckedFile, then the file of the default VFS.
struct CheckedFile {
  sqlite3_file base;
  bool is_checked;
  std::vector<std::uint32_t>* crcs;  // by offset / kPageBytes, also unique for the frames of a log; 0: unknown

  sqlite3_file* inner() { return reinterpret_cast<sqlite3_file*>(this + 1); }
  bool is_page(int size) const { return is_checked && size == kPageBytes; }
  std::uint32_t& crc_at(sqlite3_int64 offset) {
    const auto index = static_cast<std::size_t>(offset / kPageBytes);
    if (crcs->size() <= index) crcs->resize(index + 1);
    return (*crcs)[index];
  }
};

CheckedFile& checked_file(sqlite3_file* file) { return *reinterpret_cast<CheckedFile*>(file); }

std::uint32_t crc_of_page(const void* page) {
  boost::crc_32_type crc;
  crc.process_bytes(page, kPageBytes);
  return crc.checksum() == 0 ? 1 : crc.checksum();
}

int noted(int code) {
  if (code != SQLITE_OK && code != SQLITE_IOERR_SHORT_READ && disk_errno() == 0) disk_errno() = errno;
  return code;
}

int close_file(sqlite3_file* file) {
  delete checked_file(file).crcs;
  return checked_file(file).inner()->pMethods->xClose(checked_file(file).inner());
}

int read_file(sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
  CheckedFile& checked = checked_file(file);
  const int code = noted(checked.inner()->pMethods->xRead(checked.inner(), data, size, offset));
  if (code != SQLITE_OK || !checked.is_page(size)) return code;
  std::uint32_t& known = checked.crc_at(offset);
  const std::uint32_t found = crc_of_page(data);
  if (known == 0) known = found;
  return known == found ? SQLITE_OK : SQLITE_CORRUPT;
}

int write_file(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
  CheckedFile& checked = checked_file(file);
  const int code = noted(checked.inner()->pMethods->xWrite(checked.inner(), data, size, offset));
  if (checked.is_page(size)) checked.crc_at(offset) = code == SQLITE_OK ? crc_of_page(data) : 0;
  return code;
}

int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  CheckedFile& checked = checked_file(file);
  const auto pages = static_cast<std::size_t>(size / kPageBytes);
  if (checked.is_checked && checked.crcs->size() > pages) checked.crcs->resize(pages);
  return noted(checked.inner()->pMethods->xTruncate(checked.inner(), size));
}

int sync_file(sqlite3_file* file, int flags) {
  return noted(checked_file(file).inner()->pMethods->xSync(checked_file(file).inner(), flags));
}

// Version 1 of the methods: without shared memory, which exclusive locking does not need.
sqlite3_io_methods methods_of_files() {
  sqlite3_io_methods methods{};
  methods.iVersion = 1;
  methods.xClose = close_file;
  methods.xRead = read_file;
  methods.xWrite = write_file;
  methods.xTruncate = truncate_file;
  methods.xSync = sync_file;
  methods.xFileSize = [](sqlite3_file* file, sqlite3_int64* size) {
    return checked_file(file).inner()->pMethods->xFileSize(checked_file(file).inner(), size);
  };
  methods.xLock = [](sqlite3_file* file, int level) {
    return checked_file(file).inner()->pMethods->xLock(checked_file(file).inner(), level);
  };
  methods.xUnlock = [](sqlite3_file* file, int level) {
    return checked_file(file).inner()->pMethods->xUnlock(checked_file(file).inner(), level);
  };
  methods.xCheckReservedLock = [](sqlite3_file* file, int* is_reserved) {
    return checked_file(file).inner()->pMethods->xCheckReservedLock(checked_file(file).inner(), is_reserved);
  };
  methods.xFileControl = [](sqlite3_file* file, int operation, void* value) {
    return checked_file(file).inner()->pMethods->xFileControl(checked_file(file).inner(), operation, value);
  };
  methods.xSectorSize = [](sqlite3_file* file) {
    return checked_file(file).inner()->pMethods->xSectorSize(checked_file(file).inner());
  };
  methods.xDeviceCharacteristics = [](sqlite3_file* file) {
    return checked_file(file).inner()->pMethods->xDeviceCharacteristics(checked_file(file).inner());
  };
  return methods;
}

int open_file(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* found_flags) {
  static const sqlite3_io_methods kMethods = methods_of_files();
  sqlite3_vfs* const inner = sqlite3_vfs_find(nullptr);
  CheckedFile* const checked = new (file) CheckedFile{};
  const int code = noted(inner->xOpen(inner, name, checked->inner(), flags, found_flags));
  if (checked->inner()->pMethods == nullptr) return code;
  checked->base.pMethods = &kMethods;
  checked->is_checked = (flags & (SQLITE_OPEN_MAIN_DB | SQLITE_OPEN_WAL)) != 0;
  checked->crcs = new std::vector<std::uint32_t>();
  return code;
}

sqlite3_vfs make_vfs() {
  sqlite3_vfs vfs = *sqlite3_vfs_find(nullptr);
  vfs.zName = "prism_page_check";
  vfs.pNext = nullptr;
  vfs.szOsFile += static_cast<int>(sizeof(CheckedFile));
  vfs.xOpen = open_file;
  return vfs;
}

}  // namespace

const char* page_check_vfs() {
  static sqlite3_vfs vfs = make_vfs();
  static const int registered = sqlite3_vfs_register(&vfs, 0);
  return registered == SQLITE_OK ? vfs.zName : nullptr;
}

int& disk_errno() {
  static thread_local int reason = 0;
  return reason;
}

}  // namespace prism::prismweb
