#include "config/field.hpp"

// `access:` who may do what.
namespace axisd::config {

namespace {

constexpr std::string_view roles[] = {"viewer", "operator", "maintainer"};
constexpr std::string_view client_pattern = "[ -~]+";
constexpr std::string_view client_hint =
    "write the name that axisctl info shows, or unix:USER; printable ASCII only";

constexpr KeySpec axis_keys[] = {
    {.key = "roles",
     .kind = Kind::roles,
     .required = true,
     .description = "Roles on this axis, or on the axes of this group, in place of those on the machine.",
     .example = "{ panel-2: maintainer }",
     .choices = roles,
     .pattern = client_pattern,
     .pattern_hint = client_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->access->axes[t.access_axis]; })},
};

std::vector<NamedTarget> axes(const Target& t) {
  std::vector<NamedTarget> all;
  for (const auto& axis : t.configuration->access->axes) {
    all.push_back({axis.first, t});
    all.back().target.access_axis = axis.first;
  }
  return all;
}

constexpr KeySpec keys[] = {
    {.key = "roles",
     .kind = Kind::roles,
     .description = "Roles on the machine, and on each axis that access.axes says nothing of, by the name of "
                    "the client: "
                    "the common name of its certificate, else its first alternative name, or unix:USER. A "
                    "viewer reads; an "
                    "operator moves, too; a maintainer also changes parameters, addresses and the "
                    "configuration, and releases "
                    "StopAll and the holds of others. To stop needs no role.",
     .example = "{ panel-1: maintainer }",
     .choices = roles,
     .pattern = client_pattern,
     .pattern_hint = client_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->access->roles; })},
    {.key = "axes",
     .kind = Kind::named_sections,
     .description = "Roles on single axes, by the name of an axis or a group.",
     .children = axis_keys,
     .field = {.apply = [](Target& t, const Value& v) { t.access_axis = v.text; }, .inside = &axes}},
    {.key = "delegates",
     .kind = Kind::roles,
     .description = "Clients that may speak for others, whom they name in the metadata axisd-user and "
                    "axisd-role, and the "
                    "most that these others may do.",
     .example = "{ web.press-1: viewer }",
     .choices = roles,
     .pattern = client_pattern,
     .pattern_hint = client_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->access->delegates; })},
};

}  // namespace

std::span<const KeySpec> access_schema() { return keys; }

}  // namespace axisd::config
