// Connections of one process to the store: one writer and several readers, so that no read waits
// for a write or for the disk. Thread-safe.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "core/base/mutex.h"
#include "server/store/sqlite_db.h"

namespace color3d {

class SqliteConnections {
 public:
  // The file must exist.
  explicit SqliteConnections(const std::filesystem::path& file);

  // The writing connection, for one thread at a time.
  class COLOR3D_SCOPED_CAPABILITY Writer {
   public:
    explicit Writer(SqliteConnections& connections) COLOR3D_ACQUIRE(connections.writing_);
    ~Writer() COLOR3D_RELEASE();
    SqliteDatabase& operator*() const { return db_; }

   private:
    MutexLock lock_;
    SqliteDatabase& db_;
  };
  // A read transaction: all reads see one state of the store.
  class Reader {
   public:
    explicit Reader(SqliteConnections& connections);
    ~Reader();
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    operator SqliteDatabase&() const { return *db_; }  // NOLINT: stands for the connection

   private:
    SqliteConnections& connections_;
    std::unique_ptr<SqliteDatabase> db_;
  };

  // Waits while all readers are in use. Requires: the thread holds no other reader.
  Reader Read() { return Reader(*this); }

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

// A transaction of the writing connection, from construction to destruction; rolled back unless
// committed. `durable` as SqliteTransaction. Used by one thread.
class WriteTransaction {
 public:
  explicit WriteTransaction(SqliteConnections& connections, bool durable = true)
      : writer_(connections), transaction_(*writer_, durable) {}
  operator SqliteDatabase&() const { return *writer_; }  // NOLINT: stands for the connection
  template <typename... Values>
  int64_t Run(std::string_view sql, const Values&... values) {
    return (*writer_).Run(sql, values...);
  }
  void Exec(const char* sql) { (*writer_).Exec(sql); }
  void Commit() { transaction_.Commit(); }

 private:
  const SqliteConnections::Writer writer_;
  SqliteTransaction transaction_;
};

}  // namespace color3d
