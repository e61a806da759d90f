// COLMAP's database of photos and features (SQLite; COLMAP 3.8, src/base/database.h). For this
// folder only. Not thread-safe.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace color3d {

class SfmDatabase {
 public:
  // Requires: no COLMAP process uses the file. All functions throw Error{kInternal} if it is no
  // database of COLMAP's.
  explicit SfmDatabase(const std::filesystem::path& file);
  ~SfmDatabase();
  SfmDatabase(const SfmDatabase&) = delete;
  SfmDatabase& operator=(const SfmDatabase&) = delete;

  // Numbers the photos in the order of their names. COLMAP numbers them in the order in which
  // threads finish, and the mapper's results depend on it. Requires: photos are not matched yet.
  void NumberPhotosByName();

  // Descriptors of a photo as bytes; empty if it has none.
  std::string ReadDescriptors(const std::string& photo);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace color3d
