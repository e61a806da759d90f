// One connection to PostgreSQL (libpqxx); errors become Error. Not thread-safe.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "server/base/service_error.h"
#include "server/store/sql_database.h"

namespace color3d {

// The connection was lost. Whether the present transaction took effect is known unless it was being
// committed.
class LostConnection : public ServiceError {
 public:
  explicit LostConnection(const std::string& why);
  const std::string& why() const { return why_; }

 private:
  std::string why_;
};

// The database has rolled back the transaction, because it met another one.
class RolledBack : public ServiceError {
 public:
  explicit RolledBack(const std::string& why);
};

// Returns true for addresses like postgresql://HOST/DATABASE.
bool IsPostgresqlAddress(const std::string& text);
// Returns the address without its password, for messages.
std::string WithoutPassword(const std::string& address);

class PostgresqlDatabase : public SqlDatabase {
 public:
  // Connects. Throws LostConnection if that fails.
  explicit PostgresqlDatabase(const std::string& address);
  ~PostgresqlDatabase() override;
  PostgresqlDatabase(const PostgresqlDatabase&) = delete;
  PostgresqlDatabase& operator=(const PostgresqlDatabase&) = delete;

  std::unique_ptr<SqlCursor> Prepare(std::string_view sql) override;
  void Exec(const char* sql) override;
  int64_t Changes() const override { return changes_; }
  const SqlDialect& dialect() const override;
  int64_t Time() const override { return time_ms_; }

  // All reads see one state.
  void BeginRead();
  // Waits until no other process writes. `durable`: on disk when the commit returns.
  void BeginWrite(bool durable);
  // Runs `last` (statements, or "") and commits.
  void Commit(const std::string& last);
  // Ends the transaction; does nothing if there is none. Throws nothing: the connection is then
  // broken.
  void RollBack() noexcept;
  bool IsOpen() const;

 private:
  friend class PostgresqlCursor;
  struct Link;

  // Runs statements and returns the first column of the first row of the last one as a number.
  int64_t Number(const std::string& statements);

  const std::unique_ptr<Link> link_;
  int64_t changes_ = 0;
  int64_t time_ms_ = 0;
};

// Throws Error{kFailedPrecondition} if the server can be reached but refuses this role, password or
// database, and Error{kUnavailable} if it cannot be reached.
[[noreturn]] void ThrowCannotConnect(const std::string& address, const std::string& why);

// Returns the address with defaults that detect dead connections.
std::string WithTimeouts(const std::string& address);

// Settings of each connection: no wait is endless, also not that of others for this one.
extern const char kPostgresqlSession[];

}  // namespace color3d
