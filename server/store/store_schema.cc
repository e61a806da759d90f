#include "server/store/store_schema.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <optional>
#include <system_error>

#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/store/schema.h"
#include "server/store/sqlite_db.h"
#include "server/store/store_file.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kSpareBytes = int64_t{16} << 20;

// Returns nothing if the file has no tables.
std::optional<int64_t> VersionOf(SqliteDatabase& db) {
  if (!SqlStatement(db, "select 1 from sqlite_master where type='table' and name='schema_version'")
           .Step())
    return std::nullopt;
  SqlStatement version(db, "select version from schema_version");
  return version.Step() ? std::optional(version.Int(0)) : std::nullopt;
}

ServiceError WrongVersion(int64_t version, const char* remedy) {
  return ServiceError(ErrorReason::kStoreVersion,
                      "the job store has version {}, this program reads version {}; {}",
                      version,
                      kSchemaVersion,
                      remedy);
}

// Writes a complete copy or none.
void KeepCopy(const fs::path& file, int64_t version) {
  const fs::path copy = file.string() + ".v" + std::to_string(version);
  const fs::path unfinished = copy.string() + ".part";
  CopyStore(file, unfinished);
  PublishFile(unfinished, copy);
  spdlog::info("the job store is of version {}; a copy is kept in {}", version, copy.string());
}

void Migrate(SqliteDatabase& db) {
  SqliteTransaction transaction(db);
  const int64_t from = VersionOf(db).value();
  for (int64_t version = from; version < kSchemaVersion; ++version) {
    db.Exec(kMigrations[version - 1]);
  }
  db.Run("update schema_version set version=?", kSchemaVersion);
  transaction.Commit();
  spdlog::info("the job store was brought from version {} to {}", from, kSchemaVersion);
}

// Stores created before version 6 never return the space of deleted rows. Rebuilding takes twice
// the size of the file; without that space it is left to a later start.
void EnableSpaceReturn(const fs::path& file, SqliteDatabase& db) {
  const auto number = [&](const char* pragma) { return SqlStatement(db, pragma).NextInt(); };
  if (number("pragma auto_vacuum") != 0) return;
  const int64_t bytes =
      (number("pragma page_count") - number("pragma freelist_count")) * number("pragma page_size");
  std::error_code error;
  const auto free = static_cast<int64_t>(fs::space(file.parent_path(), error).available);
  if (error || free < 2 * bytes + kSpareBytes) {
    spdlog::warn(
        "the job store cannot give back space yet: {} MiB must be free on its disk at a start, {} "
        "are",
        (2 * bytes + kSpareBytes) >> 20,
        free >> 20);
    return;
  }
  try {
    db.Rebuild(file.parent_path());
    spdlog::info("the job store was built anew: it gives back space from now on");
  } catch (const Error& e) {
    spdlog::warn("the job store cannot give back space yet: {}", e.what());
  }
}

void MakeTables(SqliteDatabase& db) {
  SqliteTransaction transaction(db);
  db.Exec("create table if not exists schema_version(version integer not null)");
  if (VersionOf(db)) return;  // another store object of this process was faster
  db.Exec(kSchema);
  db.Run("insert into schema_version values(?)", kSchemaVersion);
  transaction.Commit();
}

bool IsKnown(SqliteDatabase& db, const ServerIdentity& identity) {
  return SqlStatement(db,
                      "select 1 from server where version=? and boot_id=?",
                      identity.program_version,
                      identity.boot_id)
      .Step();
}

// Writes nothing if nothing has changed, so that the server can still answer reads on a full disk.
void RecordServerIdentity(SqliteDatabase& db, const ServerIdentity& identity) {
  if (IsKnown(db, identity)) return;
  SqliteTransaction transaction(db);
  if (!SqlStatement(db, "select 1 from server where boot_id=?", identity.boot_id).Step()) {
    db.Exec("update job set lease_expires_ms=0 where state='RUNNING'");
    db.Exec(
        "update meta set value=0 where name in('collected_steady_ms', "
        "'expiry_steady_ms', 'requests_steady_ms', 'scenes_steady_ms')");
    db.Exec(
        "update job set run_after_ms=0, preferred_until_ms=0 where end_ms=0 and "
        "(run_after_ms<>0 or preferred_until_ms<>0)");
  }
  db.Run(
      "insert into server values(1, ?, ?) on conflict(id) do update set "
      "version=excluded.version, boot_id=excluded.boot_id",
      identity.program_version,
      identity.boot_id);
  transaction.Commit();
}

}  // namespace

void PrepareStore(const fs::path& file, StoreRole role, const ServerIdentity& identity) {
  SqliteDatabase db(file, SqliteAccess::kWrite);
  const std::optional<int64_t> version = VersionOf(db);
  if (version && *version > kSchemaVersion) {
    throw WrongVersion(*version,
                       "use the program that wrote it, or put back the copy that an upgrade left "
                       "beside it (jobs.db.vN)");
  }
  if (role == StoreRole::kTool) {
    if (!version) {
      throw ServiceError(ErrorReason::kStoreNotReady,
                         "{} has no tables; start color3d-server serve, which creates them",
                         file.string());
    }
    if (*version < kSchemaVersion) {
      throw WrongVersion(*version, "start color3d-server serve of this version on it first");
    }
    return;
  }
  if (!version) {
    MakeTables(db);
  } else if (*version < kSchemaVersion) {
    KeepCopy(file, *version);
    Migrate(db);
  }
  EnableSpaceReturn(file, db);
  RecordServerIdentity(db, identity);
}

}  // namespace color3d
