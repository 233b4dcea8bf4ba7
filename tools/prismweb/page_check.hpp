// SPDX-License-Identifier: MIT
// SQLite's access to files, with a check of each page and the reason of each failure.
#pragma once

namespace prism::prismweb {

/// Returns the name of an SQLite VFS for sqlite3_open_v2(), which forwards to the default one. It stores the CRC-32 of
/// each page of a database and its write-ahead log that SQLite reads or writes. If a page read later differs, the read
/// fails with SQLITE_CORRUPT: another program or the disk changed it while the file was open. Databases must be opened
/// in exclusive locking mode. Thread-safe.
const char* page_check_vfs();

/// Like errno: the reason (errno) of the first failed open, read, write, sync or truncation by this thread since it was
/// set to 0. SQLite itself changes errno after a failure.
int& disk_errno();

}  // namespace prism::prismweb
