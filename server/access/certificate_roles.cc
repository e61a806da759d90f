#include "server/access/certificate_roles.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;

std::vector<CertificateRecord> ParseCertificateRoles(std::string_view text,
                                                     const std::string& file) {
  std::vector<CertificateRecord> records;
  std::istringstream lines{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    CertificateRecord record;
    std::string role, rest;
    if (!(words >> std::quoted(record.name)) || record.name.starts_with('#')) continue;
    words >> role >> record.project;
    if (record.name.empty() || role.empty() || words >> rest) {
      throw InvalidArgument(
          "{}, line {}: expected NAME ROLE [PROJECT], a name with spaces in double quotes",
          file,
          number);
    }
    record.role = ParseRole(role, record.project, file, number);
    records.push_back(record);
  }
  return records;
}

CertificateRoles::CertificateRoles(const fs::path& file)
    : file_(file, "file of certificate roles", [this, file](const std::string& bytes) {
        records_ = ParseCertificateRoles(bytes, file.string());
      }) {
  if (records_.empty()) {
    spdlog::warn("{} has no entries: every certificate will be refused", file.string());
  }
}

std::optional<CertificateRecord> CertificateRoles::Find(const std::vector<std::string>& names) {
  std::optional<CertificateRecord> found;
  if (names.empty()) return found;
  file_.WithLatest([&] {
    const auto record = std::ranges::find_if(records_, [&](const CertificateRecord& one) {
      return one.name == "*" || std::ranges::find(names, one.name) != names.end();
    });
    if (record != records_.end()) found = *record;
  });
  if (found && found->name == "*") found->name = names.front();
  return found;
}

}  // namespace color3d
