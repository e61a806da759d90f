// Connections of one process to the store: one that writes, and some that read beside it, so that
// no read waits for a write or for a disk. Thread-safe.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include "server/store/sqlite_db.h"

namespace color3d {

class SqliteConnections {
 public:
  // The file must exist.
  explicit SqliteConnections(const std::filesystem::path& file);

  // The writer, for one thread at a time.
  class Writer {
   public:
    explicit Writer(SqliteConnections& connections)
        : lock_(connections.writing_), db_(connections.writer_) {}
    SqliteDatabase& operator*() const { return db_; }

   private:
    std::unique_lock<std::mutex> lock_;
    SqliteDatabase& db_;
  };
  // All that is read through it is of one moment.
  class Reader {
   public:
    explicit Reader(SqliteConnections& connections);
    ~Reader();
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    SqliteDatabase& operator*() const { return *db_; }

   private:
    SqliteConnections& connections_;
    std::unique_ptr<SqliteDatabase> db_;
  };

  Writer Write() { return Writer(*this); }
  // Waits while all readers are in use. A thread that has one must not ask for another.
  Reader Read() { return Reader(*this); }

 private:
  std::unique_ptr<SqliteDatabase> TakeReader();
  void PutBack(std::unique_ptr<SqliteDatabase> reader);

  const std::filesystem::path file_;
  std::mutex writing_;
  SqliteDatabase writer_;
  std::mutex reading_;
  std::condition_variable reader_is_back_;
  std::vector<std::unique_ptr<SqliteDatabase>> idle_readers_;
  int readers_ = 0;  // with those in use
};

}  // namespace color3d
