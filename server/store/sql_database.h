// Connection to a database that runs the SQL of the job store, which SQLite and PostgreSQL share.
// Errors are Error (common_store.h). Not thread-safe: one connection is used by one thread at a
// time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace color3d {

// What the SQL of the databases does not share, as parts of statements.
struct SqlDialect {
  const char* ordered_join;     // join that reads its left side first
  const char* by_blob_index;    // after `artifact a`: finds its rows by digest
  const char* unindexed;        // before a column: no index of it is used
  const char* position;         // function: place of the second text in the first, from 1; 0: none
  const char* newest_revision;  // statement: revision of the newest committed event
  const char* claim_lock;       // after the statement that chooses the next job
  const char* keyed_table;      // after a table whose only index is its primary key
  int schema_version;           // of the tables that this program reads
};

// Bytes that need not be text.
struct SqlBytes {
  std::string_view bytes;
};

// A statement of one database. Parameters are ? or ?N.
class SqlCursor {
 public:
  virtual ~SqlCursor() = default;
  virtual void Bind(int64_t value) = 0;
  virtual void Bind(double value) = 0;
  virtual void Bind(std::string_view text) = 0;
  virtual void Bind(SqlBytes bytes) = 0;
  virtual bool Step() = 0;
  virtual int64_t Int(int column) const = 0;
  virtual double Double(int column) const = 0;
  virtual std::string Text(int column) const = 0;
};

class SqlDatabase {
 public:
  virtual ~SqlDatabase() = default;
  virtual std::unique_ptr<SqlCursor> Prepare(std::string_view sql) = 0;
  // Runs statements without parameters, separated by semicolons.
  virtual void Exec(const char* sql) = 0;
  // Returns the number of rows that the last statement changed.
  virtual int64_t Changes() const = 0;
  virtual const SqlDialect& dialect() const = 0;
  // Milliseconds since the epoch by the clock of the database, at the begin of the transaction.
  virtual int64_t Time() const = 0;
  // Prepares, binds and runs a statement; returns the number of changed rows.
  template <typename... Values>
  int64_t Run(std::string_view sql, const Values&... values);
};

class SqlStatement {
 public:
  // Binds the first parameters.
  template <typename... Values>
  SqlStatement(SqlDatabase& db, std::string_view sql, const Values&... values)
      : cursor_(db.Prepare(sql)) {
    Bind(values...);
  }

  // Binds the next parameters, from the left.
  template <typename... Values>
  SqlStatement& Bind(const Values&... values) {
    (BindOne(values), ...);
    return *this;
  }
  // Moves to the next row; returns false if there is none. Throws on errors.
  bool Step() { return cursor_->Step(); }
  // Steps through all rows; for statements whose rows do not matter.
  void Run() {
    while (Step()) {
    }
  }
  // Returns the first column of the next row, or 0 if there is none.
  int64_t NextInt() { return Step() ? Int(0) : 0; }
  // Returns read(row) for each of the remaining rows.
  template <typename Read>
  auto All(const Read& read) {
    std::vector<std::invoke_result_t<Read, const SqlStatement&>> rows;
    while (Step()) rows.push_back(read(*this));
    return rows;
  }
  // Returns the first column of the remaining rows.
  std::vector<std::string> Texts() {
    return All([](const SqlStatement& row) { return row.Text(0); });
  }

  int64_t Int(int column) const { return cursor_->Int(column); }
  double Double(int column) const { return cursor_->Double(column); }
  std::string Text(int column) const { return cursor_->Text(column); }  // NULL is empty

 private:
  template <typename Value>
  void BindOne(const Value& value) {
    if constexpr (std::is_integral_v<Value>) {
      cursor_->Bind(static_cast<int64_t>(value));
    } else if constexpr (std::is_floating_point_v<Value>) {
      cursor_->Bind(static_cast<double>(value));
    } else if constexpr (std::is_same_v<Value, SqlBytes>) {
      cursor_->Bind(value);
    } else {
      cursor_->Bind(std::string_view(value));
    }
  }

  std::unique_ptr<SqlCursor> cursor_;
};

template <typename... Values>
int64_t SqlDatabase::Run(std::string_view sql, const Values&... values) {
  SqlStatement(*this, sql, values...).Run();
  return Changes();
}

}  // namespace color3d
