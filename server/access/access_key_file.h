// File with the key of an object store; reloaded after changes. Thread-safe.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "server/access/guarded_file.h"

namespace color3d {

struct AccessKey {
  std::string id, secret, session_token;
};

// Parses lines NAME = VALUE with access_key_id, secret_access_key and, for temporary keys,
// session_token, also with aws_ before the names. Ignores lines that begin with '#' and one
// [SECTION]. Throws Error{kInvalidArgument}, which never contains the secret. `file`: for messages.
AccessKey ParseAccessKey(std::string_view text, const std::string& file);

class AccessKeyFile {
 public:
  // Throws Error{kFailedPrecondition} if others than the owner may read the file, and as
  // ParseAccessKey.
  explicit AccessKeyFile(const std::filesystem::path& file);
  AccessKey Latest();

 private:
  AccessKey key_;
  GuardedFile file_;
};

}  // namespace color3d
