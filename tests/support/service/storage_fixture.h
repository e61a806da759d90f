// Fixture of the storage tests: blob and upload stores in a scratch folder.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ctime>
#include <string>

#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/storage/file_blob_store.h"
#include "server/storage/upload_store.h"

namespace color3d {

template <typename Body>
std::string ReasonThrown(const Body& body) {
  try {
    body();
  } catch (const Error& e) {
    return ReasonOf(e);
  }
  return "nothing";
}

inline void MakeOld(const std::filesystem::path& path, int hours) {
  timespec times[2] = {};
  times[0].tv_sec = times[1].tv_sec = ::time(nullptr) - hours * 3600;
  ASSERT_EQ(::utimensat(AT_FDCWD, path.c_str(), times, 0), 0);
}

inline FileDigest DigestOfBytes(const std::string& bytes) {
  return {Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
}

class StorageTest : public ::testing::Test {
 protected:
  FileDigest DigestOf(const std::string& text) { return DigestOfBytes(text); }
  ScratchFolder scratch_;
  FileBlobStore blobs_{scratch_.path() / "blobs", {0}};
  UploadStore uploads_{scratch_.path() / "uploads", blobs_, 1000};
};

}  // namespace color3d
