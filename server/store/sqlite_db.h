// Thin RAII over the SQLite C interface; errors become Error. Not thread-safe: one connection is
// used by one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace color3d {

class SqliteDatabase;

class SqliteStatement {
 public:
  SqliteStatement(SqliteDatabase& db, std::string_view sql);
  // Binds the first parameters.
  template <typename... Values>
  SqliteStatement(SqliteDatabase& db, std::string_view sql, const Values&... values)
      : SqliteStatement(db, sql) {
    Bind(values...);
  }
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  // Binds the next parameters, from the left.
  template <typename... Values>
  SqliteStatement& Bind(const Values&... values) {
    (BindOne(values), ...);
    return *this;
  }
  // Moves to the next row; returns false if there is none. Throws on errors.
  bool Step();
  // Steps through all rows; for statements whose rows do not matter.
  void Run();
  // Returns the first column of the next row, or 0 if there is none.
  int64_t NextInt() { return Step() ? Int(0) : 0; }
  // Returns read(row) for each of the remaining rows.
  template <typename Read>
  auto All(const Read& read) {
    std::vector<std::invoke_result_t<Read, const SqliteStatement&>> rows;
    while (Step()) rows.push_back(read(*this));
    return rows;
  }
  // Returns the first column of the remaining rows.
  std::vector<std::string> Texts();

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
  // Uses WAL, synchronous=FULL, foreign keys and a busy time-out of 10 s. kWrite creates the file
  // if there is none.
  SqliteDatabase(const std::filesystem::path& path, SqliteAccess access);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // Maximum time that a statement waits for other writers.
  void SetBusyTimeout(std::chrono::milliseconds timeout);
  void Exec(const char* sql);
  // Rewrites the file without its free pages (vacuum), with temporary files in `temporary`. Changes
  // nothing if it throws. Requires: no other thread uses any database.
  void Rebuild(const std::filesystem::path& temporary);
  // Prepares, binds and runs a statement; returns the number of changed rows.
  template <typename... Values>
  int64_t Run(std::string_view sql, const Values&... values) {
    SqliteStatement(*this, sql, values...).Run();
    return Changes();
  }
  sqlite3* handle() { return db_; }
  int64_t LastInsertId() const;
  int64_t Changes() const;
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
