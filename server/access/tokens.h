// Tokens of callers: a file of names, roles and digests. The server does not store the tokens
// themselves. Functions are pure except for access to the named files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/guarded_file.h"

namespace color3d {

// Each role includes the ones before it, except kWorker.
enum class Role {
  kRead,    // read, download, watch
  kSubmit,  // upload, create, change, cancel and delete
  kAdmin,   // operate the server
  kWorker,  // the calls of workers on other machines, for all projects, and no others
};
// Returns true if a caller with the role `has` may make calls that need `needed`.
constexpr bool Includes(Role has, Role needed) {
  if (has == Role::kWorker || needed == Role::kWorker) return has == needed;
  return has >= needed;
}
const char* RoleName(Role role);
// Throws Error{kInvalidArgument} with the list of roles.
Role RoleFromName(std::string_view name);

struct TokenRecord {
  std::string name;  // of the holder, for logs: 1 to 64 of letters, digits, '.', '-', '_', '@'
  Role role = Role::kRead;
  std::string sha256;   // of the token
  std::string project;  // empty: the default project
};

// Throws Error{kInvalidArgument} unless it is empty or 1 to 40 of a-z, 0-9 and '-', the first a
// letter.
void CheckProject(const std::string& project);
// Throws Error{kInvalidArgument} for a project of a worker, which runs the jobs of all projects.
void CheckRole(Role role, const std::string& project);
// Returns the role in line `line` of `file`. Throws as RoleFromName, CheckProject and CheckRole,
// with file and line before the message.
Role ParseRole(const std::string& role,
               const std::string& project,
               const std::string& file,
               int line);

// Parses lines "NAME ROLE SHA256 [PROJECT]"; empty lines and lines that begin with '#' are skipped.
// Throws Error{kInvalidArgument} with file and line.
std::vector<TokenRecord> ParseTokens(std::string_view text, const std::string& file);

// Creates a token of 256 random bits and adds its record to the file, which keeps its owner and
// permissions; a new file is readable by its owner only. Safe for concurrent processes. Throws
// Error{kAlreadyExists} if the name exists.
std::string AddToken(const std::filesystem::path& file,
                     const std::string& name,
                     Role role,
                     const std::string& project = "");

// The present contents of the file: reloaded after changes, at most once a second. If the changed
// file is unreadable or wrong, keeps the previous contents and logs an error. Thread-safe.
class TokenBook {
 public:
  // Throws Error if the file cannot be read, is wrong, or is writable by others than its owner.
  explicit TokenBook(const std::filesystem::path& file);

  // Takes constant time.
  std::optional<TokenRecord> Find(std::string_view token);

 private:
  std::vector<TokenRecord> records_;
  GuardedFile file_;  // last, because it fills the records
};

}  // namespace color3d
