// Tables of the PostgreSQL job store, and their creation and migration. Columns are those of
// SQLite (schema.h); times are milliseconds since the epoch by the clock of the database.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/store_schema.h"

namespace color3d {

// Migration N brings version N to N+1; version 0 has no tables. A published one is never changed.
constexpr int kPostgresqlVersion = 1;
extern const char* const kPostgresqlMigrations[kPostgresqlVersion];

// Advisory locks: of the transaction that writes or migrates, of the server that runs the chores of
// all.
constexpr int64_t kWriterLock = 0x436f6c6f72334401;
constexpr int64_t kChoresLock = 0x436f6c6f72334402;
// Notified with the revision of each committed event.
constexpr char kEventChannel[] = "color3d_events";

// Must be called before the database is used. The server creates or migrates the tables and
// records its version. Throws Error{kFailedPrecondition}: STORE_VERSION for tables of a newer
// program, or of an older one if opened by a worker; STORE_NOT_READY for a database without tables
// if opened by a worker; STORE_NOT_WRITABLE for a standby; STORE_VERSION for PostgreSQL before 13;
// and with the reason why the connection is refused. Throws kUnavailable if it cannot be reached.
void PreparePostgresql(const std::string& address,
                       StoreRole role,
                       const std::string& program_version);

// Creates the tables of an empty database for a copy of another store, and marks it as unfinished:
// servers refuse it while meta has the row "copying". Throws Error{kFailedPrecondition} if a server
// has used the database, and like PreparePostgresql.
void PreparePostgresqlForCopy(const std::string& address);

}  // namespace color3d
