// Creation and migration of the tables of the store. Only the server changes the schema; commands
// for operators check its version. Stateless.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

enum class StoreRole {
  kServer,  // creates and migrates the tables, records its version
  kTool,
};

struct ServerIdentity {
  std::string program_version;
  std::string boot_id;  // present start of the machine
};

// Must be called before the file is used. The server copies an older file to FILE.v<version> before
// it migrates the tables, and ends leases and pauses of other starts of the machine. Throws
// Error{kFailedPrecondition}: STORE_VERSION for a file of a newer program, or of an older one if
// opened by a tool; STORE_NOT_READY for a file without tables if opened by a tool. Throws
// kResourceExhausted if there is no room for the copy.
void PrepareStore(const std::filesystem::path& file,
                  StoreRole role,
                  const ServerIdentity& identity);

}  // namespace color3d
