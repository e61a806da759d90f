#include "server/store/user_models.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr size_t kMaxNameBytes = 64;
// Key names of safetensors and pickle files precede the data; file names of a zip follow it.
constexpr int64_t kHeadBytes = int64_t{4} << 20;
constexpr int64_t kTailBytes = int64_t{1} << 18;

bool IsName(const std::string& name) {
  const auto plain = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); };
  return !name.empty() && name.size() <= kMaxNameBytes && plain(name[0]) &&
         std::all_of(name.begin(), name.end(), [&](char c) {
           return plain(c) || c == '.' || c == '_' || c == '-';
         });
}

struct Entry {
  std::string name;
  std::string value;
};

Entry Split(const std::string& text, const std::string& flag, const std::string& what) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals + 1 == text.size()) {
    throw InvalidArgument("{} {} is not NAME={}", flag, text, what);
  }
  Entry entry{text.substr(0, equals), text.substr(equals + 1)};
  if (!IsName(entry.name)) {
    throw InvalidArgument(
        "{} {}: the name '{}' must be 1 to 64 of a-z, 0-9, '.', '_' and '-', beginning with a "
        "letter or digit",
        flag,
        text,
        entry.name);
  }
  return entry;
}

[[noreturn]] void RejectDuplicate(const std::string& flag, const std::string& name) {
  throw InvalidArgument("{} {} is given twice; give each name once", flag, name);
}

std::string ReadUpTo(std::istream& stream, int64_t bytes) {
  std::string text(static_cast<size_t>(bytes), '\0');
  stream.read(text.data(), bytes);
  text.resize(static_cast<size_t>(stream.gcount()));
  return text;
}

bool Holds(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

UserModels ParseUserModels(const std::vector<std::string>& models,
                           const std::vector<std::string>& backends) {
  UserModels result;
  for (const std::string& text : models) {
    const Entry entry = Split(text, "--model", "FILE");
    if (!result.files.emplace(entry.name, fs::absolute(entry.value)).second) {
      RejectDuplicate("--model", entry.name);
    }
  }
  for (const std::string& text : backends) {
    const Entry entry = Split(text, "--backend", "ADDRESS");
    if (!result.backends.emplace(entry.name, entry.value).second) {
      RejectDuplicate("--backend", entry.name);
    }
  }
  return result;
}

void RequireReadable(const UserModels& models) {
  for (const auto& [name, file] : models.files) {
    std::error_code none;
    if (!fs::is_regular_file(file, none) || !std::ifstream(file, std::ios::binary).good()) {
      throw Error(
          ErrorCode::kNotFound,
          "--model {}={}: there is no such file that can be read; name the file with the weights",
          name,
          file.string());
    }
  }
}

std::vector<std::string> ToFlags(const UserModels& models) {
  std::vector<std::string> flags;
  for (const auto& [name, file] : models.files) {
    flags.insert(flags.end(), {"--model", name + "=" + file.string()});
  }
  for (const auto& [name, address] : models.backends) {
    flags.insert(flags.end(), {"--backend", name + "=" + address});
  }
  return flags;
}

std::string GuessModelKind(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(ErrorCode::kNotFound, "cannot read {}", file.string());
  const std::string head = ReadUpTo(stream, kHeadBytes);
  std::error_code error;
  const auto size = static_cast<int64_t>(fs::file_size(file, error));
  stream.clear();
  stream.seekg(std::max<int64_t>(0, size - kTailBytes));
  const std::string tail = ReadUpTo(stream, kTailBytes);
  if (head.starts_with("PK") && (Holds(head, "/code/") || Holds(tail, "/code/"))) {
    return "torchscript";
  }
  if (Holds(head, "visual.conv1") || Holds(head, "vision_model.")) return "clip";
  if (Holds(head, "encoder.arch.")) return "ddcolor";
  if (Holds(head, "downsample_layers.")) return "convnext";
  return "unknown";
}

std::string FileIdentity(const fs::path& file) {
  struct stat facts {};
  if (::stat(file.c_str(), &facts) != 0) return "";
  const auto number = [](auto value) { return std::to_string(value) + " "; };
  return number(facts.st_dev) + number(facts.st_ino) + number(facts.st_size) +
         number(facts.st_mtim.tv_sec) + number(facts.st_mtim.tv_nsec) +
         number(facts.st_ctim.tv_sec) + number(facts.st_ctim.tv_nsec);
}

std::vector<fs::path> FilesOfModel(const fs::path& file) {
  std::vector<fs::path> files = {file};
  for (const char* name : {"bpe_simple_vocab_16e6.txt",
                           "bpe_simple_vocab_16e6.txt.gz",
                           "merges.txt",
                           "config.json",
                           "open_clip_config.json"}) {
    std::error_code none;
    const fs::path beside = file.parent_path() / name;
    if (beside != file && fs::is_regular_file(beside, none)) files.push_back(beside);
  }
  return files;
}

FileDigest FileDigests::Of(const fs::path& file) {
  const MutexLock lock(mutex_);
  const std::string identity = FileIdentity(file);
  const auto known = known_.find(file);
  if (known != known_.end() && !identity.empty() && known->second.identity == identity) {
    return known->second.digest;
  }
  const FileDigest digest = DigestFile(file);
  known_[file] = {identity, digest};
  return digest;
}

std::string DigestsOfModel(const std::filesystem::path& file, FileDigests& digests) {
  std::string lines;
  for (const std::filesystem::path& part : FilesOfModel(file)) {
    lines += part.filename().string() + ' ' + digests.Of(part).sha256 + '\n';
  }
  return lines;
}

}  // namespace color3d
