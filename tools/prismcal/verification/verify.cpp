// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/verify.hpp"

#include <algorithm>
#include <filesystem>

#include "tools/prismcal/verification/checks.hpp"

namespace prism::verification {

std::size_t VerificationResult::faults() const {
  const auto bad = [](const Finding& finding) { return is_fault(finding.state); };
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(), bad));
}

std::string without_path(const Error& error, const std::string& path) {
  std::string text = error.text();
  if (!text.starts_with(path + ":")) return text;
  return text.substr(text.find_first_not_of(' ', path.size() + 1));
}

VerificationResult verify(const std::string& path, const tables::ReadProgress& progress) {
  VerificationResult result;
  for (const FolderContents& contents : contents_of(path)) {
    check_log(contents, progress, result);
    check_captures(contents, result);
    for (const std::string& other : contents.others)
      result.findings.push_back({other, FileState::kSkipped, "not a file of prism"});
  }
  const auto& findings = result.findings;
  if (std::all_of(findings.begin(), findings.end(), [](const Finding& f) { return f.state == FileState::kSkipped; }))
    result.findings.push_back(
        {path, FileState::kUnreadable,
         "found no log or capture; prismd --check checks models, frame descriptions and configurations"});
  return result;
}

}  // namespace prism::verification
