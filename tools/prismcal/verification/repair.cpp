// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/repair.hpp"

#include <algorithm>
#include <filesystem>

#include "base/file.hpp"
#include "daemon/pipeline/segment_index.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/copies.hpp"

namespace prism::verification {
namespace {

namespace fs = std::filesystem;

// Copies models, frame descriptions and configurations without faults. Leaves out the others, and JSON of another type.
Result<void> copy_documents(const FolderContents& contents, const Copies& copies) {
  for (const std::string& path : contents.documents) {
    const auto finding = check_document(path, contents.one_file);
    if (!finding || is_fault(finding->state)) {
      copies.leave_out(path, 0, finding ? finding->text : "JSON of another type");
      continue;
    }
    if (auto done = copy_bytes(path, copies); !done) return done;
    ++copies.repaired.documents;
  }
  return {};
}

Result<void> copy_folder(const FolderContents& contents, const Copies& copies) {
  std::error_code error;
  fs::create_directories(copies.out, error);
  if (error) return make_error(copies.out.string(), "cannot be created: " + error.message());
  for (const std::string& path : contents.others) copies.leave_out(path, 0, "not a file of prism");
  if (auto done = copy_log(contents, copies); !done) return done;
  if (auto done = copy_captures(contents, copies); !done) return done;
  return copy_documents(contents, copies);
}

// Returns true if `path` is `folder` or is below it.
bool is_within(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path inner = fs::weakly_canonical(path, error), outer = fs::weakly_canonical(folder, error);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

Result<void> copy_bytes(const std::string& path, const Copies& copies) {
  const auto text = read_text_file(path, kMaxTableBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  return write_text_file(copies.target(path), *text);
}

Result<void> write_index(const std::string& name, const std::vector<std::pair<std::string, std::uint64_t>>& made,
                         const Copies& copies) {
  const std::string path = (copies.out / name).string();
  pipeline::SegmentIndex index(path);
  index.refresh({});
  for (const auto& [file, rows] : made) {
    index.made(file);
    if (rows > 0) index.ended(file, rows);
  }
  pipeline::SegmentIndex written(path);
  if (!written.read() || written.files().size() != made.size()) return make_error(path, "the index cannot be written");
  return {};
}

Result<Repaired> repair(const std::string& path, const std::string& out) {
  std::error_code error;
  if (!fs::exists(path, error)) return make_error(path, "file not found");
  if (is_within(out, path)) return make_error(out, "is within " + path + ", expected a folder elsewhere");
  const bool is_new = !fs::exists(fs::symlink_status(out, error));
  if (!is_new && (!fs::is_directory(out, error) || !fs::is_empty(out, error) || error))
    return make_error(out, "exists and is not an empty folder; expected a new one");
  Repaired repaired;
  for (const FolderContents& contents : contents_of(path)) {
    const fs::path below = contents.one_file ? fs::path() : fs::relative(contents.folder, path, error);
    const Copies copies{fs::path(out) / below, repaired};
    if (auto done = copy_folder(contents, copies); !done) return tl::unexpected<Error>(done.error());
  }
  if (repaired.segments + repaired.captures + repaired.documents == 0) return make_error(path, "found nothing to copy");
  for (const Finding& finding : verify(out).findings) {
    if (is_fault(finding.state)) return make_error(finding.path, "the copy is damaged: " + finding.text);
  }
  return repaired;
}

}  // namespace prism::verification
