// The weights and model servers of the user's that jobs may name: set when the server starts,
// handed to its workers, never changed over RPC.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/mutex.h"

namespace color3d {

struct UserModels {
  std::map<std::string, std::filesystem::path> files;  // absolute paths, by name
  std::map<std::string, std::string> backends;         // addresses, by name
};

// From "NAME=FILE" and "NAME=ADDRESS". A name is 1 to 64 of a-z, 0-9, '.', '_', '-', and begins
// with a letter or digit. Throws Error{kInvalidArgument} naming the entry that is malformed or a
// name that is given twice.
UserModels ParseUserModels(const std::vector<std::string>& models,
                           const std::vector<std::string>& backends);

// Throws Error{kNotFound} naming the first model whose file cannot be read.
void RequireReadable(const UserModels& models);

// The flags that hand the models to a worker: "--model", "NAME=FILE", ...
std::vector<std::string> ToFlags(const UserModels& models);

// "a, b and c", or "none": for error messages.
template <typename Value>
std::string NamesOf(const std::map<std::string, Value>& entries) {
  std::string text;
  for (const auto& [name, value] : entries) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

// Kind of a weight file, by its first megabytes: "clip", "ddcolor", "convnext",
// "torchscript" or "unknown". For people who list models: nothing relies on it. Throws
// Error{kNotFound}.
std::string LooksLike(const std::filesystem::path& file);

// Distinguishes states of a file without reading it; empty if there is no such file.
std::string FileIdentity(const std::filesystem::path& file);

// The file itself and what models read beside it when it is there: CLIP's vocabulary and
// configuration. Whoever compares states of a model compares all of them.
std::vector<std::filesystem::path> FilesOfModel(const std::filesystem::path& file);

// Digests of large files, read again only when the file has changed. Thread-safe; two threads that
// ask for the same file read it once.
class FileDigests {
 public:
  // Throws Error{kNotFound}.
  FileDigest Of(const std::filesystem::path& file);

 private:
  struct Known {
    std::string identity;
    FileDigest digest;
  };
  Mutex mutex_;
  std::map<std::filesystem::path, Known> known_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
