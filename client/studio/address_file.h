// A page in a file that only its owner can read. It leads the browser to the studio, so that the
// secret of the address stands in no list of processes, where every user could read it.
#pragma once

#include <filesystem>
#include <string>

namespace color3d::client {

// A folder that other users cannot enter: $XDG_RUNTIME_DIR if it is, else `otherwise`, which is
// made so.
std::filesystem::path PrivateFolder(const std::filesystem::path& otherwise);

// Exists as long as this object. Not thread-safe.
class AddressFile {
 public:
  // A page in `folder` that opens `address`. Throws Error{kFailedPrecondition} if it cannot be
  // written.
  AddressFile(const std::filesystem::path& folder, const std::string& address);
  ~AddressFile();
  AddressFile(const AddressFile&) = delete;
  AddressFile& operator=(const AddressFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
};

// Writes a page that says `text`, for users without a terminal, and returns its path.
std::filesystem::path WriteMessagePage(const std::filesystem::path& folder,
                                       const std::string& text);

}  // namespace color3d::client
