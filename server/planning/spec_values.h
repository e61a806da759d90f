// The values that are set in the options of a job, at any depth. Stateless.
#pragma once

#include <google/protobuf/message.h>

#include <functional>
#include <string>

namespace color3d {

struct SpecValue {
  const google::protobuf::Message& owner;
  const google::protobuf::FieldDescriptor* field;  // of `owner`
  int index;                                       // in a repeated field; else -1
  const google::protobuf::Message* message;        // the value; nullptr for other types
  std::string path;                                // as a client writes it: "truth[0].image"
};

// Visits the values in the order of the fields, a message before its own. `path`: of `owner`.
void ForEachValue(const google::protobuf::Message& owner,
                  const std::function<void(const SpecValue&)>& visit,
                  const std::string& path = "");

}  // namespace color3d
