// Who may call the server: a file of names, roles and digests of tokens. The tokens themselves are
// nowhere on the server. Functions are pure but for the files that they name.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/guarded_file.h"

namespace color3d {

// Each may do what those before it may.
enum class Role {
  kRead,    // look at everything, download, watch
  kSubmit,  // upload, create, change, cancel and delete
  kAdmin,   // how the server runs
};
const char* RoleName(Role role);
// Throws Error{kInvalidArgument} that names the roles that there are.
Role RoleFromName(std::string_view name);

struct TokenRecord {
  std::string name;  // of who has it, for logs: 1 to 64 of letters, digits, '.', '-', '_', '@'
  Role role = Role::kRead;
  std::string sha256;   // of the token
  std::string project;  // that it belongs to; empty: the one of all without a project
};

// Throws Error{kInvalidArgument} unless it is empty or 1 to 40 of a-z, 0-9 and '-', the first a
// letter.
void CheckProject(const std::string& project);
// The role that line `line` of `file` gives, in `project`. Throws as RoleFromName and CheckProject,
// with the file and the line before the message.
Role RoleOfLine(const std::string& role,
                const std::string& project,
                const std::string& file,
                int line);

// Lines "NAME ROLE SHA256 [PROJECT]"; empty ones and those that begin with '#' are skipped. Throws
// Error{kInvalidArgument} naming file and line.
std::vector<TokenRecord> ParseTokens(std::string_view text, const std::string& file);

// A fresh token of 256 random bits, of which the record is added to the file, which keeps its owner
// and rights; a new file can be read by its owner alone. Processes that add at the same time wait
// for each other. Throws Error{kAlreadyExists} when the name is there.
std::string AddToken(const std::filesystem::path& file,
                     const std::string& name,
                     Role role,
                     const std::string& project = "");

// The file as it is now: read again when it has changed, at most once a second. A file that has
// become unreadable or wrong changes nothing, and is said in the log. Thread-safe.
class TokenBook {
 public:
  // Throws Error for a file that cannot be read, is wrong, or that others than its owner may
  // change.
  explicit TokenBook(const std::filesystem::path& file);

  // Takes the same time whichever token it is.
  std::optional<TokenRecord> Find(std::string_view token);

 private:
  std::vector<TokenRecord> records_;
  GuardedFile file_;  // the last: it fills the records
};

}  // namespace color3d
