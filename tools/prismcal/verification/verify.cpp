// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/verify.hpp"

#include <algorithm>
#include <filesystem>

#include "tools/prismcal/verification/checks.hpp"

namespace prism::verification {

std::size_t Verdict::faults() const {
  const auto bad = [](const Finding& finding) { return is_fault(finding.state); };
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(), bad));
}

std::string without_path(const Error& error, const std::string& path) {
  std::string text = error.text();
  if (!text.starts_with(path + ":")) return text;
  return text.substr(text.find_first_not_of(' ', path.size() + 1));
}

Verdict verify(const std::string& path) {
  Verdict verdict;
  for (const FolderContents& contents : contents_of(path)) {
    check_log(contents, verdict);
    check_captures(contents, verdict);
    for (const std::string& document : contents.documents) {
      auto finding = check_document(document, contents.one_file);
      verdict.findings.push_back(finding ? std::move(*finding)
                                         : Finding{document, State::kPassedOver, "JSON of another kind"});
    }
    for (const std::string& other : contents.others)
      verdict.findings.push_back({other, State::kPassedOver, "none of prism's files"});
  }
  const auto& findings = verdict.findings;
  if (std::all_of(findings.begin(), findings.end(), [](const Finding& f) { return f.state == State::kPassedOver; }))
    verdict.findings.push_back({path, State::kRefused, "holds no log, capture, model, frames or configuration"});
  return verdict;
}

}  // namespace prism::verification
