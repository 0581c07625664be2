// Chosen fields of axis states, by reflection.
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <map>

#include "api/axisctl/format.hpp"
#include "api/axisctl/state_view.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::string value_text(const Message& message, const FieldDescriptor& field, int index) {
  const auto& reflection = *message.GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
    return json(index < 0 ? reflection.GetMessage(message, &field)
                          : reflection.GetRepeatedMessage(message, &field, index));
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE && index < 0)
    return number(reflection.GetDouble(message, &field));
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING && index < 0)
    return reflection.GetString(message, &field);
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(message, &field, index, &text);
  return text;
}

/// Leaves the fields that `paths` name; the JSON of a message has the others, too, as 0 or empty.
void keep(google::protobuf::Struct& object, const std::vector<std::string>& paths) {
  std::map<std::string, std::vector<std::string>> kept;
  for (const auto& path : paths) {
    const auto dot = path.find('.');
    auto& below = kept[path.substr(0, dot)];
    if (dot != path.npos) below.push_back(path.substr(dot + 1));
  }
  auto& fields = *object.mutable_fields();
  for (auto field = fields.begin(); field != fields.end();) {
    const auto found = kept.find(field->first);
    if (found == kept.end()) {
      field = fields.erase(field);
      continue;
    }
    if (!found->second.empty() && field->second.has_struct_value())
      keep(*field->second.mutable_struct_value(), found->second);
    ++field;
  }
}

}  // namespace

std::string field_json(const v1::WatchAxesResponse& batch, const std::vector<std::string>& fields) {
  google::protobuf::Struct object;
  if (!google::protobuf::util::JsonStringToMessage(json(batch), &object).ok()) return json(batch);
  auto paths = fields;
  paths.emplace_back("axis");
  for (auto& state : *(*object.mutable_fields())["axes"].mutable_list_value()->mutable_values())
    keep(*state.mutable_struct_value(), paths);
  return json(object);
}

std::string field_text(const Message& message, std::string_view path) {
  const auto dot = path.find('.');
  const auto* field = message.GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
  if (field == nullptr) return "-";
  const auto& reflection = *message.GetReflection();
  if (field->is_repeated()) {
    std::vector<std::string> values;
    values.reserve(static_cast<std::size_t>(reflection.FieldSize(message, field)));
    for (int i = 0; i < reflection.FieldSize(message, field); ++i)
      values.push_back(value_text(message, *field, i));
    return values.empty() ? "-" : fmt::format("{}", fmt::join(values, " "));
  }
  if (field->has_presence() && !reflection.HasField(message, field)) return "-";
  if (dot == path.npos) {
    auto text = value_text(message, *field, -1);
    return text.empty() ? "-" : text;
  }
  if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) return "-";
  return field_text(reflection.GetMessage(message, field), path.substr(dot + 1));
}

Table field_table(const google::protobuf::RepeatedPtrField<v1::AxisState>& axes,
                  const std::vector<std::string>& fields) {
  std::vector<std::string> titles{"AXIS"};
  titles.insert(titles.end(), fields.begin(), fields.end());
  Table table(titles);
  for (const auto& state : axes) {
    std::vector<Cell> row{state.axis()};
    row.reserve(fields.size() + 1);
    for (const auto& field : fields) row.emplace_back(field_text(state, field));
    table.add(std::move(row));
  }
  return table;
}

std::string field_line(const v1::WatchAxesResponse& batch, const std::vector<std::string>& fields) {
  std::string text = std::to_string(batch.tick());
  for (const auto& state : batch.axes()) {
    text += "  " + state.axis();
    for (const auto& field : fields) text += fmt::format(" {}={}", field, field_text(state, field));
  }
  return text;
}

}  // namespace axisd::axisctl
