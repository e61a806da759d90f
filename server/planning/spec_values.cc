#include "server/planning/spec_values.h"

#include <fmt/core.h>

#include <vector>

namespace color3d {
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

void ForEachValue(const Message& owner,
                  const std::function<void(const SpecValue&)>& visit,
                  const std::string& path) {
  const google::protobuf::Reflection* reflection = owner.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(owner, &fields);
  for (const FieldDescriptor* field : fields) {
    const std::string here = path.empty() ? field->name() : path + "." + field->name();
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    const auto visit_one = [&](const SpecValue& value) {
      visit(value);
      if (is_message) ForEachValue(*value.message, visit, value.path);
    };
    if (!field->is_repeated()) {
      visit_one(
          {owner, field, -1, is_message ? &reflection->GetMessage(owner, field) : nullptr, here});
      continue;
    }
    for (int i = 0; i < reflection->FieldSize(owner, field); ++i) {
      visit_one({owner,
                 field,
                 i,
                 is_message ? &reflection->GetRepeatedMessage(owner, field, i) : nullptr,
                 fmt::format("{}[{}]", here, i)});
    }
  }
}

}  // namespace color3d
