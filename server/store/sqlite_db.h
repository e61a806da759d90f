// Thin RAII over the SQLite C interface; errors become Error. Not thread-safe: one connection is
// used by one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace color3d {

class SqliteStatement {
 public:
  SqliteStatement(sqlite3* db, std::string_view sql);
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  // Binds the next parameters, from the left.
  template <typename... Values>
  SqliteStatement& Bind(const Values&... values) {
    (BindOne(values), ...);
    return *this;
  }
  // True when there is a row; throws on errors.
  bool Step();
  // Steps through all rows; for statements whose rows do not matter.
  void Run();

  int64_t Int(int column) const;
  double Double(int column) const;
  std::string Text(int column) const;  // text or blob; NULL is empty

 private:
  void BindOne(int64_t value);
  void BindOne(int value) { BindOne(static_cast<int64_t>(value)); }
  void BindOne(bool value) { BindOne(static_cast<int64_t>(value)); }
  void BindOne(double value);
  void BindOne(std::string_view text);
  void BindOne(const std::string& text) { BindOne(std::string_view(text)); }
  void BindOne(const char* text) { BindOne(std::string_view(text)); }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
  int next_parameter_ = 1;
};

enum class SqliteAccess { kRead, kWrite };

class SqliteDatabase {
 public:
  // WAL, synchronous=FULL, foreign keys on, busy time-out 10 s. To write: creates the file when
  // there is none.
  SqliteDatabase(const std::filesystem::path& path, SqliteAccess access);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // How long a statement waits for others that write.
  void SetBusyTimeout(std::chrono::milliseconds timeout);
  void Exec(const char* sql);
  // Writes the whole file again, without what is free in it; nothing changes when it throws. What
  // it needs meanwhile lies in `temporary`. Not while other threads use any database.
  void Rebuild(const std::filesystem::path& temporary);
  // Prepares, binds and runs to the end; returns the number of rows changed.
  template <typename... Values>
  int64_t Run(std::string_view sql, const Values&... values) {
    SqliteStatement statement(db_, sql);
    statement.Bind(values...);
    statement.Run();
    return Changes();
  }
  sqlite3* handle() { return db_; }
  int64_t LastInsertId() const;
  int64_t Changes() const;
  // Of SQLite's virtual machine, for all statements of all databases that have ended so far: what
  // they cost, whatever the machine.
  static int64_t Steps();

 private:
  bool IsEmpty();

  sqlite3* db_ = nullptr;
};

// BEGIN IMMEDIATE ... COMMIT; rolled back unless committed. `durable`: synced to disk when Commit
// returns; otherwise a power failure (not a crash of ours) may lose it.
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
