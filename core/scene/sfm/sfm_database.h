// What COLMAP keeps of photos and features, in a database of its own that nobody else sees (SQLite;
// COLMAP 3.8, src/base/database.h). For this folder only. Not thread-safe.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace color3d {

class SfmDatabase {
 public:
  // No program of COLMAP's may be running on it. Throws Error{kInternal}, also below, for what is
  // no database of COLMAP's.
  explicit SfmDatabase(const std::filesystem::path& file);
  ~SfmDatabase();
  SfmDatabase(const SfmDatabase&) = delete;
  SfmDatabase& operator=(const SfmDatabase&) = delete;

  // Gives photos numbers in the order of their names. COLMAP's follow from which thread was ready
  // first, and what the mapper does follows from them. To be called before photos are matched.
  void NumberPhotosByName();

  // The bytes of a photo's descriptors; empty for a photo without any.
  std::string DescriptorsOf(const std::string& photo);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace color3d
