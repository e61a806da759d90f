#include "server/access/tokens.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <spdlog/spdlog.h>
#include <sys/random.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr std::array<const char*, 4> kRoleNames = {"read", "submit", "admin", "worker"};
constexpr size_t kTokenBytes = 32;
constexpr char kPrefix[] = "c3d_";  // lets leak scanners detect tokens

bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || std::strchr(".-_@", c) != nullptr;
         });
}

std::string RandomToken() {
  std::array<unsigned char, kTokenBytes> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Error(ErrorCode::kInternal, "no random numbers: {}", std::strerror(errno));
  }
  std::string token = kPrefix;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace

const char* RoleName(Role role) { return kRoleNames[static_cast<size_t>(role)]; }

Role RoleFromName(std::string_view name) {
  for (size_t i = 0; i < kRoleNames.size(); ++i) {
    if (name == kRoleNames[i]) return static_cast<Role>(i);
  }
  throw InvalidArgument("there is no role '{}'; use read, submit, admin or worker", name);
}

void CheckProject(const std::string& project) {
  const bool good =
      project.empty() ||
      (project.size() <= 40 && project[0] >= 'a' && project[0] <= 'z' &&
       project.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos);
  if (!good) {
    throw InvalidArgument(
        "'{}' is not a project name: 1 to 40 of a-z, 0-9 and '-', the first a letter",
        project.substr(0, 80));
  }
}

void CheckRole(Role role, const std::string& project) {
  if (role != Role::kWorker || project.empty()) return;
  throw InvalidArgument(
      "the role worker has the project '{}'; give it none, because workers run the jobs of all "
      "projects",
      project);
}

Role ParseRole(const std::string& role,
               const std::string& project,
               const std::string& file,
               int line) {
  try {
    const Role named = RoleFromName(role);
    CheckProject(project);
    CheckRole(named, project);
    return named;
  } catch (const Error& e) {
    throw InvalidArgument("{}, line {}: {}", file, line, e.what());
  }
}

std::vector<TokenRecord> ParseTokens(std::string_view text, const std::string& file) {
  std::vector<TokenRecord> records;
  std::istringstream lines{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    TokenRecord record;
    std::string role, rest;
    if (!(words >> record.name) || record.name[0] == '#') continue;
    words >> role >> record.sha256 >> record.project;
    if (!IsName(record.name) || !IsSha256Hex(record.sha256) || words >> rest) {
      throw InvalidArgument(
          "{}, line {}: expected NAME ROLE SHA256 [PROJECT], as `color3d-server token` writes it",
          file,
          number);
    }
    record.role = ParseRole(role, record.project, file, number);
    records.push_back(record);
  }
  return records;
}

std::string AddToken(const fs::path& file,
                     const std::string& name,
                     Role role,
                     const std::string& project) {
  CheckProject(project);
  CheckRole(role, project);
  if (!IsName(name)) {
    throw InvalidArgument(
        "'{}' is not a valid name: 1 to 64 of letters, digits, '.', '-', '_' and '@'",
        name.substr(0, 80));
  }
  // Follows a link, so that the link stays; under a lock, so that concurrent additions are all
  // kept.
  std::error_code error;
  const fs::path real = fs::weakly_canonical(file, error);
  const fs::path& target = error ? file : real;
  const FolderTurn turn(target.has_parent_path() ? target.parent_path() : fs::path("."));
  std::string text;
  if (fs::exists(target, error)) {
    text = ReadFile(target);
    for (const TokenRecord& record : ParseTokens(text, file.string())) {
      if (record.name != name) continue;
      throw Error(ErrorCode::kAlreadyExists,
                  "{} has a token for '{}' already; remove its line first, or choose another name",
                  file.string(),
                  name);
    }
    if (!text.empty() && text.back() != '\n') text += '\n';
  }
  const std::string token = RandomToken();
  text += fmt::format("{} {} {}{}{}\n",
                      name,
                      RoleName(role),
                      Sha256Hex(token),
                      project.empty() ? "" : " ",
                      project);
  const mode_t before = ::umask(0077);
  try {
    WriteFileAtomic(target, text);
  } catch (...) {
    ::umask(before);
    throw;
  }
  ::umask(before);
  return token;
}

TokenBook::TokenBook(const fs::path& file)
    : file_(file, "token file", [this, file](const std::string& bytes) {
        records_ = ParseTokens(bytes, file.string());
      }) {
  if (records_.empty()) {
    spdlog::warn("{} has no entries: every call will be refused", file.string());
  }
}

std::optional<TokenRecord> TokenBook::Find(std::string_view token) {
  const std::string digest = Sha256Hex(token);
  std::optional<TokenRecord> found;
  file_.WithLatest([&] {
    for (const TokenRecord& record : records_) {
      if (CRYPTO_memcmp(record.sha256.data(), digest.data(), digest.size()) == 0) found = record;
    }
  });
  return found;
}

}  // namespace color3d
