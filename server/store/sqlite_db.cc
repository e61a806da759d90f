#include "server/store/sqlite_db.h"

#include <fmt/core.h>
#include <sqlite3.h>

#include <atomic>
#include <cerrno>
#include <exception>
#include <string>

#include "server/base/service_error.h"
#include "server/store/schema.h"

namespace color3d {
namespace {

constexpr char kShrinkable[] = "pragma auto_vacuum=INCREMENTAL";

std::atomic<int64_t> g_steps{0};

[[noreturn]] void ThrowSqlite(sqlite3* db, int code, const std::string& what) {
  const std::string detail = db != nullptr ? sqlite3_errmsg(db) : sqlite3_errstr(code);
  const std::string text = fmt::format("job store: {}: {}", what, detail);
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw ServiceError(ErrorReason::kStoreBusy, "{}; try again", text);
    case SQLITE_FULL:
      throw ServiceError(ErrorReason::kStorageFull, "{}; free some disk space", text);
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      throw ServiceError(
          ErrorReason::kStoreNotWritable, "{}; check the permissions of the data directory", text);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      throw ServiceError(ErrorReason::kStoreCorrupt,
                         "{}; restore jobs.db from a backup or start with a fresh --data-dir",
                         text);
    default:
      // On a full disk the index of the log cannot grow: SQLITE_IOERR_SHMSIZE.
      if (db != nullptr && (sqlite3_system_errno(db) == ENOSPC || code == SQLITE_IOERR_SHMSIZE)) {
        throw ServiceError(ErrorReason::kStorageFull, "{}; free some disk space", text);
      }
      throw ServiceError(ErrorReason::kStoreError, text);
  }
}

constexpr SqlDialect kSqliteDialect = {
    .ordered_join = "cross join",
    .by_blob_index = "indexed by artifact_blob",
    .unindexed = "+",
    .position = "instr",
    .newest_revision = "select seq from sqlite_sequence where name='job_event'",
    .claim_lock = "",
    .keyed_table = "without rowid",
    .schema_version = kSchemaVersion};

class SqliteCursor : public SqlCursor {
 public:
  SqliteCursor(sqlite3* db, std::string_view sql) : db_(db) {
    Check(sqlite3_prepare_v2(db_, sql.data(), static_cast<int>(sql.size()), &statement_, nullptr),
          "cannot prepare a statement");
  }
  ~SqliteCursor() override {
    if (statement_ != nullptr) {
      g_steps += sqlite3_stmt_status(statement_, SQLITE_STMTSTATUS_VM_STEP, 0);
    }
    sqlite3_finalize(statement_);
  }
  SqliteCursor(const SqliteCursor&) = delete;
  SqliteCursor& operator=(const SqliteCursor&) = delete;

  void Bind(int64_t value) override {
    Check(sqlite3_bind_int64(statement_, next_parameter_++, value), "cannot bind a number");
  }
  void Bind(double value) override {
    Check(sqlite3_bind_double(statement_, next_parameter_++, value), "cannot bind a number");
  }
  void Bind(std::string_view text) override {
    const char* data = text.data() != nullptr ? text.data() : "";
    Check(sqlite3_bind_text64(
              statement_, next_parameter_++, data, text.size(), SQLITE_TRANSIENT, SQLITE_UTF8),
          "cannot bind text");
  }
  void Bind(SqlBytes bytes) override { Bind(bytes.bytes); }
  bool Step() override {
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    ThrowSqlite(db_, code, "cannot run a statement");
  }
  int64_t Int(int column) const override { return sqlite3_column_int64(statement_, column); }
  double Double(int column) const override { return sqlite3_column_double(statement_, column); }
  std::string Text(int column) const override {
    const void* data = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return data != nullptr ? std::string(static_cast<const char*>(data), size) : std::string();
  }

 private:
  void Check(int code, const char* what) const {
    if (code != SQLITE_OK) ThrowSqlite(db_, code, what);
  }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
  int next_parameter_ = 1;
};

}  // namespace

SqliteDatabase::SqliteDatabase(const std::filesystem::path& path, SqliteAccess access) {
  // Without memory statistics, connections do not share a lock.
  static const int uncounted = sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);
  static_cast<void>(uncounted);
  const bool writes = access == SqliteAccess::kWrite;
  // Readers open the file for writing, too: sharing the index of the log requires it.
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | (writes ? SQLITE_OPEN_CREATE : 0);
  const int code = sqlite3_open_v2(path.c_str(), &db_, flags, nullptr);
  try {
    if (code != SQLITE_OK) ThrowSqlite(db_, code, "cannot open " + path.string());
    sqlite3_extended_result_codes(db_, 1);
    SetBusyTimeout(std::chrono::seconds(10));
    // A sandboxed worker may not write temporary files.
    Exec("pragma temp_store=MEMORY");
    if (writes) {
      // ReturnFreeSpace requires incremental vacuum. On an existing file this pragma would write.
      if (IsEmpty()) Exec(kShrinkable);
      Exec("pragma journal_size_limit=4194304");
      Exec("pragma journal_mode=WAL");
      Exec("pragma synchronous=FULL");
      Exec("pragma foreign_keys=ON");
    } else {
      Exec("pragma query_only=ON");
    }
  } catch (...) {
    sqlite3_close(db_);
    throw;
  }
}

SqliteDatabase::~SqliteDatabase() { sqlite3_close(db_); }

bool SqliteDatabase::IsEmpty() {
  SqlStatement pages(*this, "pragma page_count");
  return !pages.Step() || pages.Int(0) == 0;
}

void SqliteDatabase::SetBusyTimeout(std::chrono::milliseconds timeout) {
  sqlite3_busy_timeout(db_, static_cast<int>(timeout.count()));
}

void SqliteDatabase::Exec(const char* sql) {
  const int code = sqlite3_exec(db_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) ThrowSqlite(db_, code, fmt::format("cannot run '{}'", sql));
}

void SqliteDatabase::Rebuild(const std::filesystem::path& temporary) {
  char* const before = sqlite3_temp_directory;
  sqlite3_temp_directory = sqlite3_mprintf("%s", temporary.c_str());
  Exec(kShrinkable);
  Exec("pragma temp_store=FILE");
  std::exception_ptr failed;
  try {
    Exec("vacuum");
  } catch (const Error&) {
    failed = std::current_exception();
  }
  Exec("pragma temp_store=MEMORY");
  sqlite3_free(sqlite3_temp_directory);
  sqlite3_temp_directory = before;
  if (failed) std::rethrow_exception(failed);
}

int64_t SqliteDatabase::Steps() { return g_steps; }
int64_t SqliteDatabase::Changes() const { return sqlite3_changes64(db_); }
const SqlDialect& SqliteDatabase::dialect() const { return kSqliteDialect; }

std::unique_ptr<SqlCursor> SqliteDatabase::Prepare(std::string_view sql) {
  return std::make_unique<SqliteCursor>(db_, sql);
}

int64_t SqliteDatabase::Time() const {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

SqliteTransaction::SqliteTransaction(SqliteDatabase& db, bool durable)
    : db_(db), durable_(durable) {
  if (!durable_) db_.Exec("pragma synchronous=NORMAL");
  try {
    db_.Exec("begin immediate");
  } catch (...) {
    if (!durable_) db_.Exec("pragma synchronous=FULL");
    throw;
  }
}

SqliteTransaction::~SqliteTransaction() {
  try {
    if (open_) db_.Exec("rollback");
  } catch (const Error&) {
    // SQLite has already rolled back by itself (disk full, I/O error).
  }
  try {
    if (!durable_) db_.Exec("pragma synchronous=FULL");
  } catch (const Error&) {
    // Impossible outside a transaction; the next commit would merely be less durable.
  }
}

void SqliteTransaction::Commit() {
  db_.Exec("commit");
  open_ = false;
}

}  // namespace color3d
