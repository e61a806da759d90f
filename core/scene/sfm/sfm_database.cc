#include "core/scene/sfm/sfm_database.h"

#include <fmt/core.h>
#include <sqlite3.h>

#include "core/base/error.h"

namespace color3d {

struct SfmDatabase::Connection {
  sqlite3* db = nullptr;
  ~Connection() { sqlite3_close(db); }
  Error Failed(const char* what) const {
    return Error(ErrorCode::kInternal, "colmap's database: {}: {}", what, sqlite3_errmsg(db));
  }
  void Run(const char* sql) const {
    if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) throw Failed("update");
  }
};

SfmDatabase::SfmDatabase(const std::filesystem::path& file)
    : connection_(std::make_unique<Connection>()) {
  if (sqlite3_open_v2(file.c_str(), &connection_->db, SQLITE_OPEN_READWRITE, nullptr) !=
      SQLITE_OK) {
    throw connection_->Failed("open");
  }
  // A sandboxed worker may write beside the database, but not in folders for temporary files.
  connection_->Run("PRAGMA temp_store = MEMORY");
}

SfmDatabase::~SfmDatabase() = default;

void SfmDatabase::NumberPhotosByName() {
  // First assigns numbers out of range, since numbers must be unique at all times.
  connection_->Run(
      "BEGIN;"
      "CREATE TEMP TABLE numbers AS SELECT image_id AS old, 1000000000 + "
      "  ROW_NUMBER() OVER (ORDER BY name) AS new FROM images;"
      "CREATE UNIQUE INDEX temp.numbers_old ON numbers(old);"
      "UPDATE images SET image_id = (SELECT new FROM numbers WHERE old = image_id);"
      "UPDATE keypoints SET image_id = (SELECT new FROM numbers WHERE old = image_id);"
      "UPDATE descriptors SET image_id = (SELECT new FROM numbers WHERE old = image_id);"
      "UPDATE images SET image_id = image_id - 1000000000;"
      "UPDATE keypoints SET image_id = image_id - 1000000000;"
      "UPDATE descriptors SET image_id = image_id - 1000000000;"
      "DROP TABLE numbers;"
      "COMMIT");
}

std::string SfmDatabase::ReadDescriptors(const std::string& photo) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(connection_->db,
                         "SELECT data FROM descriptors JOIN images USING (image_id) WHERE name = ?",
                         -1,
                         &statement,
                         nullptr) != SQLITE_OK) {
    throw connection_->Failed("query");
  }
  const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> owner(statement, &sqlite3_finalize);
  sqlite3_bind_text(statement, 1, photo.data(), static_cast<int>(photo.size()), SQLITE_TRANSIENT);
  const int step = sqlite3_step(statement);
  if (step == SQLITE_DONE) return "";
  if (step != SQLITE_ROW) throw connection_->Failed("read");
  const int size = sqlite3_column_bytes(statement, 0);
  const void* data = sqlite3_column_blob(statement, 0);
  return data == nullptr ? "" : std::string(static_cast<const char*>(data), size);
}

}  // namespace color3d
