// Roles of clients that authenticate by certificate, from a file of names and roles.
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
  std::string name;  // common or alternative name; "*": any name
  Role role = Role::kRead;
  std::string project;  // empty: the default project
};

// Parses lines "NAME ROLE [PROJECT]"; a name with spaces stands in double quotes; empty lines and
// lines that begin with '#' are skipped. Throws Error{kInvalidArgument} with file and line.
std::vector<CertificateRecord> ParseCertificateRoles(std::string_view text,
                                                     const std::string& file);

// The present contents of the file, like TokenBook. Thread-safe.
class CertificateRoles {
 public:
  explicit CertificateRoles(const std::filesystem::path& file);

  // Returns the first line that has one of these names, or "*"; its name is then the first of
  // `names`.
  std::optional<CertificateRecord> Find(const std::vector<std::string>& names);

 private:
  std::vector<CertificateRecord> records_;
  GuardedFile file_;  // last, because it fills records_
};

}  // namespace color3d
