// Converts store records to messages of the public API; resource names and page tokens.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "color3d/v1/colorizer.pb.h"
#include "color3d/v1/job.pb.h"
#include "color3d/v1/scene.pb.h"
#include "server/planning/spec_check.h"
#include "server/store/client_store.h"

namespace color3d {

v1::Digest ToProto(const FileDigest& digest);
v1::Scene ToProto(const SceneRecord& scene);
v1::Job ToProto(const JobRecord& job);
// Sets only name, parent, kind, state, attempt, progress and revision.
v1::Job ToProgressProto(const JobRecord& job);
v1::Colorizer ToProto(const ColorizerRecord& colorizer);
google::protobuf::Timestamp ToTimestamp(int64_t ms);
v1::Job::State StateToProto(JobState state);

// Throws Error{kInvalidArgument} unless `name` is "<collection>/<id>" with a plausible id.
void CheckName(std::string_view name, std::string_view collection);
// Throws Error{kInvalidArgument} naming the digest.
FileDigest FromProto(const v1::Digest& digest);

// Page tokens are opaque to clients: id of the last row, bound to the listing they belong to.
std::string MakePageToken(int64_t last_id, const std::string& listing);
// Returns 0 for an empty token. Throws Error{kInvalidArgument} for a token of another listing.
int64_t ParsePageToken(const std::string& token, const std::string& listing);
// Returns 1..1000; 0 means 50. Throws Error{kInvalidArgument}.
int PageSize(int requested);

// Approximate maximum size of a page of a list: a longer page ends early.
constexpr size_t kMaxPageBytes = 1 << 20;
// Memory for the records of one page. Longer specs, accepted by older releases, are left out of
// lists.
constexpr ListBudget kListBudget = {2 << 20, kMaxSpecBytes};

template <typename Message>
size_t Put(Message message, Message* place) {
  *place = std::move(message);
  return place->ByteSizeLong();
}

// Answers a List call. `read(before_id, limit, &is_cut)` returns records, newest first, and sets
// `is_cut` if memory allows fewer than `limit`. `add(record)` appends a record to the response and
// returns its size in bytes. Page tokens of a listing other than `listing` are refused.
template <typename Request, typename Response, typename Read, typename Add>
void AnswerPage(const Request& request,
                const std::string& listing,
                Response* response,
                const Read& read,
                const Add& add) {
  const auto size = static_cast<size_t>(PageSize(request.page_size()));
  bool is_cut = false;
  // One record more than the page holds tells whether there is another page.
  const auto records =
      read(ParsePageToken(request.page_token(), listing), static_cast<int>(size) + 1, &is_cut);
  size_t added = 0;
  for (size_t bytes = 0; added < std::min(size, records.size()) && bytes < kMaxPageBytes; ++added) {
    bytes += add(records[added]);
  }
  if (added > 0 && (is_cut || added < records.size())) {
    response->set_next_page_token(MakePageToken(records[added - 1].id, listing));
  }
}

}  // namespace color3d
