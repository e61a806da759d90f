#include "server/rpc/blobs/blob_service.h"

#include <charconv>
#include <set>

#include "color3d/v1/blob.grpc.pb.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

std::vector<std::string> SplitSlashes(const std::string& text) {
  std::vector<std::string> parts;
  size_t start = 0;
  while (true) {
    const size_t end = text.find('/', start);
    parts.push_back(text.substr(start, end - start));
    if (end == std::string::npos) return parts;
    start = end + 1;
  }
}

FileDigest ParseDigest(const std::string& sha256, const std::string& size) {
  v1::Digest digest;
  digest.set_sha256(sha256);
  int64_t bytes = 0;
  const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), bytes);
  if (error != std::errc() || end != size.data() + size.size()) {
    throw InvalidArgument("'{}' is not a size in bytes", size.substr(0, 40));
  }
  digest.set_size_bytes(bytes);
  return FromProto(digest);
}

class BlobServiceImpl final : public v1::BlobService::CallbackService {
 public:
  explicit BlobServiceImpl(const RpcParts& parts) : parts_(parts) {}

  ServerUnaryReactor* FindMissingBlobs(CallbackServerContext* context,
                                       const v1::FindMissingBlobsRequest* request,
                                       v1::FindMissingBlobsResponse* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      if (request->digests_size() > 10'000) {
        throw InvalidArgument("digests has {} entries; at most 10000 are allowed",
                              request->digests_size());
      }
      std::vector<std::string> asked;
      for (const v1::Digest& proto : request->digests()) {
        asked.push_back(FromProto(proto).sha256);
      }
      const std::set<std::string> held = call.store.HeldBlobs(asked);
      std::set<std::string> seen;
      std::vector<FileDigest> touched;
      std::vector<const v1::Digest*> protos;
      for (const v1::Digest& proto : request->digests()) {
        const FileDigest digest = FromProto(proto);
        if (!seen.insert(digest.sha256).second) continue;
        if (held.contains(digest.sha256)) {
          touched.push_back(digest);
          protos.push_back(&proto);
        } else {
          *response->add_missing() = proto;
        }
      }
      const std::vector<bool> stored = parts_.blobs.TouchAll(touched);
      for (size_t i = 0; i < stored.size(); ++i) {
        if (!stored[i]) *response->add_missing() = *protos[i];
      }
    });
  }

 private:
  const RpcParts& parts_;
};

}  // namespace

UploadName ParseUploadName(const std::string& resource) {
  const std::vector<std::string> parts = SplitSlashes(resource);
  if (parts.size() != 5 || parts[0] != "uploads" || parts[2] != "blobs") {
    throw InvalidArgument(
        "the resource '{}' must be 'uploads/{{uuid}}/blobs/{{sha256}}/{{size_bytes}}'",
        resource.substr(0, 200));
  }
  return {parts[1], ParseDigest(parts[3], parts[4])};
}

FileDigest ParseBlobName(const std::string& resource) {
  const std::vector<std::string> parts = SplitSlashes(resource);
  if (parts.size() != 3 || parts[0] != "blobs") {
    throw InvalidArgument("the resource '{}' must be 'blobs/{{sha256}}/{{size_bytes}}'",
                          resource.substr(0, 200));
  }
  return ParseDigest(parts[1], parts[2]);
}

std::unique_ptr<grpc::Service> MakeBlobService(const RpcParts& parts) {
  return std::make_unique<BlobServiceImpl>(parts);
}

}  // namespace color3d
