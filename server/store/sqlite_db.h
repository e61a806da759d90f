// Thin RAII over the SQLite C interface; errors become Error. Not thread-safe: one connection is
// used by one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "server/store/sql_database.h"

struct sqlite3;

namespace color3d {

using SqliteStatement = SqlStatement;

enum class SqliteAccess { kRead, kWrite };

class SqliteDatabase : public SqlDatabase {
 public:
  // Uses WAL, synchronous=FULL, foreign keys and a busy time-out of 10 s. kWrite creates the file
  // if there is none.
  SqliteDatabase(const std::filesystem::path& path, SqliteAccess access);
  ~SqliteDatabase() override;
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // Maximum time that a statement waits for other writers.
  void SetBusyTimeout(std::chrono::milliseconds timeout);
  void Exec(const char* sql) override;
  std::unique_ptr<SqlCursor> Prepare(std::string_view sql) override;
  int64_t Changes() const override;
  const SqlDialect& dialect() const override;
  int64_t Time() const override;
  // Rewrites the file without its free pages (vacuum), with temporary files in `temporary`. Changes
  // nothing if it throws. Requires: no other thread uses any database.
  void Rebuild(const std::filesystem::path& temporary);
  // Number of steps of SQLite's virtual machine in all finished statements of all databases: their
  // cost, independent of the machine.
  static int64_t Steps();

 private:
  bool IsEmpty();

  sqlite3* db_ = nullptr;
};

// BEGIN IMMEDIATE ... COMMIT; rolled back unless committed. `durable`: synced to disk when Commit
// returns; otherwise a power failure (not a crash of the process) may lose it.
class SqliteTransaction {
 public:
  explicit SqliteTransaction(SqliteDatabase& db, bool durable = true);
  ~SqliteTransaction();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;
  void Commit();

 private:
  SqliteDatabase& db_;
  bool durable_;
  bool open_ = true;
};

}  // namespace color3d
