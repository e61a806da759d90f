// Who may make and change the tables of the store's file. The schema belongs to the server: workers
// only look whether they understand it.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

enum class StoreRole {
  kServer,  // makes the tables, brings older ones up to date, says what version of the program it
            // is
  kWorker,
};

struct ServerIdentity {
  std::string program_version;
  std::string boot_id;  // of the machine's present start
};

// Before the file is used. The server keeps a copy of an older file beside it, FILE.v<version>,
// before it changes the tables; leases and pauses of another start of the machine end then. Throws
// Error{kFailedPrecondition}: STORE_VERSION for a file of a newer program, or of an older one when
// a worker opens it; STORE_NOT_READY for one without tables when a worker opens it.
// kResourceExhausted when there is no room for the copy.
void PrepareStore(const std::filesystem::path& file,
                  StoreRole role,
                  const ServerIdentity& identity);

}  // namespace color3d
