// Connections of one process to a SQLite store: one writer and several readers, so that no read
// waits for a write or for the disk. Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/mutex.h"
#include "server/store/sql_connections.h"
#include "server/store/sqlite_db.h"

namespace color3d {

class SqliteConnections : public SqlConnections {
 public:
  // The file must exist.
  explicit SqliteConnections(const std::filesystem::path& file);

  // Runs `action` with the writing connection outside of a transaction.
  void Maintain(const std::function<void(SqliteDatabase&)>& action);

 protected:
  // Waits while all readers are in use.
  void RunRead(const Action& action) override;
  void RunWrite(const Action& action, bool durable) override;

 private:
  std::unique_ptr<SqliteDatabase> AcquireReader();
  void ReleaseReader(std::unique_ptr<SqliteDatabase> reader);

  const std::filesystem::path file_;
  Mutex writing_;
  SqliteDatabase writer_ COLOR3D_GUARDED_BY(writing_);
  Mutex reading_;
  CondVar reader_is_back_;
  std::vector<std::unique_ptr<SqliteDatabase>> idle_readers_ COLOR3D_GUARDED_BY(reading_);
  int readers_ COLOR3D_GUARDED_BY(reading_) = 0;  // idle and in use
};

}  // namespace color3d
