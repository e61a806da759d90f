#include "server/access/access_key_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

std::string Trimmed(const std::string& text) {
  constexpr char kSpace[] = " \t\r";
  const size_t begin = text.find_first_not_of(kSpace);
  return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

bool IsPrintable(const std::string& text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c > ' ' && c < 127; });
}

}  // namespace

AccessKey ParseAccessKey(std::string_view text, const std::string& file) {
  AccessKey key;
  const std::map<std::string, std::string*> known{{"access_key_id", &key.id},
                                                  {"secret_access_key", &key.secret},
                                                  {"session_token", &key.session_token}};
  std::istringstream lines{std::string(text)};
  int number = 0, sections = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line = Trimmed(line);
    if (line.empty() || line.starts_with('#')) continue;
    if (line.starts_with('[')) {
      if (++sections == 1) continue;
      throw InvalidArgument(
          "{}, line {}: a second section; leave the one that is meant", file, number);
    }
    const size_t equals = line.find('=');
    std::string name = equals == line.npos ? "" : Trimmed(line.substr(0, equals));
    if (name.starts_with("aws_")) name.erase(0, 4);
    const auto field = known.find(name);
    if (field == known.end()) {
      throw InvalidArgument(
          "{}, line {}: expected access_key_id = ID, secret_access_key = SECRET or "
          "session_token = TOKEN",
          file,
          number);
    }
    *field->second = Trimmed(line.substr(equals + 1));
    if (field->second->empty() || !IsPrintable(*field->second)) {
      throw InvalidArgument(
          "{}, line {}: the value of {} is empty or has spaces", file, number, name);
    }
  }
  if (key.id.empty() || key.secret.empty()) {
    throw InvalidArgument(
        "{} has no line {} = ...", file, key.id.empty() ? "access_key_id" : "secret_access_key");
  }
  return key;
}

AccessKeyFile::AccessKeyFile(const fs::path& file)
    : file_(file, "file with the key of the object store", [this, file](const std::string& bytes) {
        struct stat status {};
        if (::stat(file.c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
          throw Error(ErrorCode::kFailedPrecondition,
                      "the key of the object store in {} is accessible by others than its owner; "
                      "run chmod 600 {}",
                      file.string(),
                      file.string());
        }
        key_ = ParseAccessKey(bytes, file.string());
      }) {}

AccessKey AccessKeyFile::Latest() {
  AccessKey key;
  file_.WithLatest([&] { key = key_; });
  return key;
}

}  // namespace color3d
