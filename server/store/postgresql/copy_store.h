// Copies a SQLite store into a PostgreSQL database. Stateless.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

namespace color3d {

struct CopiedStore {
  std::map<std::string, int64_t> rows;  // by table
};

// Copies the state of the file at this moment; a server may run on it, and its later writes are not
// copied. Leases and pauses end. The database must be empty, or hold an earlier copy that no server
// has used, which is replaced: an interrupted copy can be repeated, and servers refuse it until it
// is whole. At the end each table is read back and its rows and digest are compared. `progress` is
// called with each table and the rows copied so far. Throws Error{kFailedPrecondition} for another
// file or database, Error{kDataLoss} if the copy differs.
CopiedStore CopyToPostgresql(
    const std::filesystem::path& sqlite_file,
    const std::string& address,
    const std::function<void(const std::string& table, int64_t rows)>& progress);

}  // namespace color3d
