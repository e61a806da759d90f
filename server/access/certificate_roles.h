// What clients may do by the certificate that they show: a file of names and roles.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/guarded_file.h"
#include "server/access/tokens.h"

namespace color3d {

struct CertificateRecord {
  std::string name;  // common or alternative name; "*": any
  Role role = Role::kRead;
  std::string project;  // empty: the one of all without a project
};

// Lines "NAME ROLE [PROJECT]"; a name with spaces stands in double quotes; empty lines and those
// that begin with '#' are skipped. Throws Error{kInvalidArgument} naming file and line.
std::vector<CertificateRecord> ParseCertificateRoles(std::string_view text,
                                                     const std::string& file);

// The file as it is now, as TokenBook. Thread-safe.
class CertificateRoles {
 public:
  explicit CertificateRoles(const std::filesystem::path& file);

  // Of the first line that has one of these names, or "*"; its name is then the certificate's
  // first.
  std::optional<CertificateRecord> Find(const std::vector<std::string>& names);

 private:
  std::vector<CertificateRecord> records_;
  GuardedFile file_;  // the last: it fills the records
};

}  // namespace color3d
