// Identifiers and resource names. Pure functions.
#pragma once

#include <string>

#include "core/base/digest.h"

namespace color3d::client {

// Random (version 4) UUID in its usual spelling, for request ids and uploads.
std::string NewUuid();

// "jobs/3f" for "3f" and for "jobs/3f"; throws InvalidArgument for "scenes/3f" or an empty text.
std::string ResourceName(const std::string& text, const std::string& collection);

// Resource names of ByteStream.
std::string UploadResource(const std::string& uuid, const FileDigest& digest);
std::string BlobResource(const FileDigest& digest);

// "a/b/photo.jpg" -> "photo".
std::string Stem(const std::string& path);

}  // namespace color3d::client
