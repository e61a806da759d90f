#include "client/studio/address_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "client/lib/names.h"
#include "core/base/error.h"
#include "core/base/file_descriptor.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr char kMessageName[] = "color3d-studio-message.html";

bool IsPrivate(const fs::path& folder) {
  struct stat facts {};
  return ::stat(folder.c_str(), &facts) == 0 && S_ISDIR(facts.st_mode) &&
         facts.st_uid == ::geteuid() && (facts.st_mode & 077) == 0;
}

std::string HtmlText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&') {
      safe += "&amp;";
    } else if (c == '<') {
      safe += "&lt;";
    } else if (c == '"') {
      safe += "&quot;";
    } else {
      safe += c;
    }
  }
  return safe;
}

void WritePrivate(const fs::path& file, const std::string& text) {
  // O_EXCL: no file or link of somebody else's is written to.
  const FileDescriptor fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (fd.get() >= 0 &&
      ::write(fd.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size())) {
    return;
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "cannot write {}: {}; run `color3d studio --no-open` and open its address by hand",
              file.string(),
              std::strerror(errno));
}

}  // namespace

fs::path PrivateFolder(const fs::path& otherwise) {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && runtime[0] == '/' && IsPrivate(runtime)) return runtime;
  std::error_code none;  // writing tells
  fs::create_directories(otherwise, none);
  fs::permissions(otherwise, fs::perms::owner_all, none);
  return otherwise;
}

AddressFile::AddressFile(const fs::path& folder, const std::string& address)
    : path_(folder / ("color3d-studio-" + NewUuid() + ".html")) {
  WritePrivate(path_,
               "<!doctype html><meta charset=\"utf-8\"><title>Color3D Studio</title>"
               "<meta name=\"referrer\" content=\"no-referrer\">"
               "<meta http-equiv=\"refresh\" content=\"0;url=" +
                   HtmlText(address) + "\">");
}

AddressFile::~AddressFile() {
  std::error_code none;
  fs::remove(path_, none);
}

fs::path WriteMessagePage(const fs::path& folder, const std::string& text) {
  const fs::path file = folder / kMessageName;
  std::error_code none;
  fs::remove(file, none);
  WritePrivate(file,
               "<!doctype html><meta charset=\"utf-8\"><title>Color3D Studio</title>"
               "<meta name=\"color-scheme\" content=\"light dark\">"
               "<body style=\"font:16px/1.5 system-ui,sans-serif;max-width:40rem;margin:3rem "
               "auto;padding:0 1rem\"><h1>Color3D Studio could not start</h1>"
               "<p style=\"white-space:pre-line\">" +
                   HtmlText(text) + "</p>");
  return file;
}

}  // namespace color3d::client
