// A private PostgreSQL server for tests: data and socket in a temporary folder, no network, one
// database for each test. Runs as the user postgres if the test is root's. Not thread-safe.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/files.h"

namespace color3d::testing {

class PostgresqlCluster {
 public:
  // Returns true if the programs of PostgreSQL are there (Debian: postgresql-15).
  static bool IsInstalled();
  // That of the test program, started by the first call.
  static PostgresqlCluster& Shared();

  // Creates the data and starts the server. `settings`: "name=value".
  explicit PostgresqlCluster(std::vector<std::string> settings = {});
  // Ends the server and removes the data.
  ~PostgresqlCluster();
  PostgresqlCluster(const PostgresqlCluster&) = delete;
  PostgresqlCluster& operator=(const PostgresqlCluster&) = delete;

  // Returns the address of a new database: empty, or with the tables of the store.
  std::string NewDatabase(bool with_tables = true);
  std::string AddressOf(const std::string& database) const;
  // Path of the socket.
  std::filesystem::path Socket() const;
  // Lets everybody in from these addresses, e.g. "10.0.0.0/8". Requires: `listen_addresses` is set.
  void AllowFrom(const std::string& addresses);
  // Kills the server without a shutdown.
  void Kill();
  void Start();
  void Run(const std::string& sql, const std::string& database = "postgres") const;

 private:
  ScratchFolder scratch_;
  const std::filesystem::path folder_ = scratch_.path();
  std::vector<std::string> settings_;
  pid_t server_ = 0;
  int databases_ = 0;
  bool has_template_ = false;
};

}  // namespace color3d::testing
