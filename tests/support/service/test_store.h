// The kind of job store that tests of the service use: SQLite, or PostgreSQL if the environment has
// COLOR3D_TEST_STORE=postgresql. Not thread-safe.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/store/job_store.h"
#include "server/store/sql_database.h"

namespace color3d::testing {

bool TestsUsePostgresql();
// Returns a store with the system's clocks for the file, or for a new database in its place.
std::unique_ptr<JobStore> OpenTestStore(const std::filesystem::path& file);

// Returns the address for `serve --store` of a server on this data folder; empty: SQLite. The
// database is created by the first call for the folder.
std::string TestStoreAddress(const std::filesystem::path& data_folder);
// Opens the database of a server on this data folder.
std::unique_ptr<SqlDatabase> OpenTestDatabase(const std::filesystem::path& data_folder);
// Kills the database server, as a power failure would, and starts it again. Requires PostgreSQL.
void RestartTestDatabase();

}  // namespace color3d::testing
