#include "server/store/postgresql/postgresql_schema.h"

#include <spdlog/spdlog.h>

#include <memory>
#include <optional>

#include "server/base/service_error.h"
#include "server/store/postgresql/postgresql_db.h"

namespace color3d {
namespace {

constexpr int64_t kOldestServer = 130000;  // PostgreSQL 13
constexpr int64_t kDayMs = 24 * 3'600'000;

int64_t Setting(SqlDatabase& db, const char* expression) {
  return SqlStatement(db, std::string("select ") + expression).NextInt();
}

void RequireUsable(SqlDatabase& db, const std::string& address) {
  const int64_t version = Setting(db, "current_setting('server_version_num')::bigint");
  if (version < kOldestServer) {
    throw ServiceError(ErrorReason::kStoreVersion,
                       "the job store {} is PostgreSQL {}; 13 or later is required",
                       WithoutPassword(address),
                       version / 10000);
  }
  if (Setting(db, "pg_is_in_recovery()") != 0 ||
      Setting(db, "current_setting('default_transaction_read_only')::boolean") != 0) {
    throw ServiceError(ErrorReason::kStoreNotWritable,
                       "the job store {} is read-only; name the primary server in --store, not a "
                       "standby",
                       WithoutPassword(address));
  }
}

// Returns nothing if the database has no tables.
std::optional<int64_t> TablesVersion(SqlDatabase& db) {
  if (Setting(db, "to_regclass('schema_version') is not null") == 0) return std::nullopt;
  SqlStatement version(db, "select version from schema_version");
  return version.Step() ? std::optional(version.Int(0)) : std::nullopt;
}

ServiceError WrongTables(int64_t version, const char* remedy) {
  return ServiceError(ErrorReason::kStoreVersion,
                      "the tables of the job store have version {}, this program reads version {}; "
                      "{}",
                      version,
                      kPostgresqlVersion,
                      remedy);
}

// In the present transaction, which excludes all other writers.
void BringUpToDate(PostgresqlDatabase& db) {
  db.Exec("set local statement_timeout=0");
  const int64_t from = TablesVersion(db).value_or(0);
  if (from == 0) {
    db.Exec("create table schema_version(version bigint not null)");
    db.Run("insert into schema_version values(0)");
  }
  for (int64_t version = from; version < kPostgresqlVersion; ++version) {
    db.Exec(kPostgresqlMigrations[version]);
  }
  if (from < kPostgresqlVersion) {
    db.Run("update schema_version set version=?", kPostgresqlVersion);
    spdlog::info(
        "the tables of the job store were brought from version {} to {}", from, kPostgresqlVersion);
  }
}

std::unique_ptr<PostgresqlDatabase> Connect(const std::string& address) {
  std::unique_ptr<PostgresqlDatabase> db;
  try {
    db = std::make_unique<PostgresqlDatabase>(address);
  } catch (const LostConnection& e) {
    ThrowCannotConnect(address, e.why());
  }
  RequireUsable(*db, address);
  const std::optional<int64_t> version = TablesVersion(*db);
  if (version && *version > kPostgresqlVersion) {
    throw WrongTables(*version,
                      "use the program that wrote them, or restore a dump of before the upgrade");
  }
  return db;
}

}  // namespace

void PreparePostgresql(const std::string& address,
                       StoreRole role,
                       const std::string& program_version) {
  const std::unique_ptr<PostgresqlDatabase> db = Connect(address);
  const std::optional<int64_t> version = TablesVersion(*db);
  if (version && SqlStatement(*db, "select 1 from meta where name='copying'").Step()) {
    throw ServiceError(
        ErrorReason::kStoreNotReady,
        "the copy of a store into {} was not finished; repeat color3d-server migrate",
        WithoutPassword(address));
  }
  if (role == StoreRole::kTool) {
    if (!version) {
      throw ServiceError(ErrorReason::kStoreNotReady,
                         "{} has no tables; start color3d-server serve, which creates them",
                         WithoutPassword(address));
    }
    if (*version < kPostgresqlVersion) {
      throw WrongTables(*version, "the running server is older than this worker: restart it");
    }
    return;
  }
  // Writes nothing if nothing has changed, so that the server can still answer reads on a full
  // disk.
  if (version == kPostgresqlVersion &&
      SqlStatement(*db, "select 1 from server where version=?", program_version).Step()) {
    return;
  }
  db->BeginWrite(/*durable=*/true);
  BringUpToDate(*db);
  db->Run("insert into server values(1, ?) on conflict(id) do update set version=excluded.version",
          program_version);
  db->Run("delete from commit_mark where at_ms<?", db->Time() - kDayMs);
  db->Commit("");
}

void PreparePostgresqlForCopy(const std::string& address) {
  const std::unique_ptr<PostgresqlDatabase> db = Connect(address);
  db->BeginWrite(/*durable=*/true);
  BringUpToDate(*db);
  if (SqlStatement(*db, "select 1 from server").Step()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the job store {} was used by a server; name an empty database",
                WithoutPassword(address));
  }
  db->Run("insert into meta values('copying', 1) on conflict do nothing");
  db->Commit("");
}

}  // namespace color3d
