// Weight files and model servers that jobs may name: set when the server starts, passed to its
// workers, never changed over RPC.
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

// Parses "NAME=FILE" and "NAME=ADDRESS". A name is 1 to 64 of a-z, 0-9, '.', '_', '-', and begins
// with a letter or digit. Throws Error{kInvalidArgument} with the malformed entry or repeated name.
UserModels ParseUserModels(const std::vector<std::string>& models,
                           const std::vector<std::string>& backends);

// Throws Error{kNotFound} with the first model whose file is unreadable.
void RequireReadable(const UserModels& models);

// Returns the flags that pass the models to a worker: "--model", "NAME=FILE", ...
std::vector<std::string> ToFlags(const UserModels& models);

// Returns "a, b, c" or "none", for error messages.
template <typename Value>
std::string NamesOf(const std::map<std::string, Value>& entries) {
  std::string text;
  for (const auto& [name, value] : entries) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

// Guesses the kind of a weight file, for display only: "clip", "ddcolor", "convnext", "torchscript"
// or "unknown". Throws Error{kNotFound}.
std::string GuessModelKind(const std::filesystem::path& file);

// Identifies the state of a file without reading it; empty if there is no such file.
std::string FileIdentity(const std::filesystem::path& file);

// Returns the file and the existing files that are read with it: vocabulary and configuration of
// CLIP. Comparisons of a model must include all of them.
std::vector<std::filesystem::path> FilesOfModel(const std::filesystem::path& file);

class FileDigests;

// Returns a line "NAME SHA256" for each of FilesOfModel(file): equal texts, equal weights. Throws
// Error{kNotFound}.
std::string DigestsOfModel(const std::filesystem::path& file, FileDigests& digests);

// Digests of large files, recomputed only for changed files. Thread-safe; concurrent calls for one
// file read it once.
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
