#include <fmt/format.h>

#include <array>
#include <utility>

#include "discover.hpp"
#include "records.hpp"

namespace spindle::commands {
namespace {

using report::Align;
using report::Cell;
using report::left_out;

const std::array<report::Column, 7> columns = {{{"SERIAL", "serial"},
                                                {"MODEL", "model"},
                                                {"FIRMWARE", "firmware"},
                                                {"URL", "endpoint"},
                                                {"MAC", "mac", Align::left, 0, left_out(1)},
                                                {"IN USE", "in_use", Align::left, 0, left_out(2)},
                                                {"NAME", "name"}}};

template <typename Number>
Cell number_or_null(const std::optional<Number>& value) {
  return value ? number(static_cast<std::int64_t>(*value)) : Cell();
}

std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// The product in front of what it says of its model: "BMT 3216".
std::string shown_model(const device::FoundTool& tool) {
  std::string kind = tool.kind_name;
  if (kind.empty() && tool.kind) kind = fmt::format("type {}", *tool.kind);
  if (!tool.model) return kind;
  return kind.empty() ? std::to_string(*tool.model) : fmt::format("{} {}", kind, *tool.model);
}

/// Where nothing else is said, a tool is where its answer came from.
std::string endpoint_of(const work::Heard& heard) {
  const std::string& address = heard.tool.address.empty() ? heard.from : heard.tool.address;
  return heard.tool.port ? fmt::format("tcp://{}:{}", address, *heard.tool.port)
                         : fmt::format("tcp://{}", address);
}

}  // namespace

std::span<const report::Column> discovered_columns() { return columns; }

Discovered discovered(const work::Heard& heard, const Context& context) {
  const device::FoundTool& tool = heard.tool;
  const std::string endpoint = endpoint_of(heard);
  const std::string name = name_in_tools_file(endpoint, context);
  const std::string& address = tool.address.empty() ? heard.from : tool.address;
  const std::string in_use = !tool.in_use ? "" : *tool.in_use ? "yes" : "no";
  report::Record record{.type = "discovered",
                        .target = name.empty() ? endpoint : name,
                        .time = context.clock.wall(),
                        .fields = {{"found_by", std::string("multicast")},
                                   {"endpoint", endpoint},
                                   {"address", address},
                                   {"port", number_or_null(tool.port)},
                                   {"unit", Cell()},
                                   {"serial", text_or_null(tool.serial)},
                                   {"model", number_or_null(tool.model), shown_model(tool)},
                                   {"tool_type", text_or_null(tool.kind_name)},
                                   {"tool_type_code", number_or_null(tool.kind)},
                                   {"firmware", number_or_null(tool.firmware)},
                                   {"mac", text_or_null(tool.mac)},
                                   {"in_use", tool.in_use ? Cell(*tool.in_use) : Cell(), in_use},
                                   {"profile", Cell()},
                                   {"name", text_or_null(name)},
                                   {"from", heard.from},
                                   {"interface", heard.interface}}};
  return {std::move(record), endpoint, tool.serial, lower_case(tool.kind_name), {}, name};
}

Discovered discovered(const work::SweptTool& swept, const Context& context) {
  const std::string& endpoint = swept.target.endpoint.text;
  const std::string name = name_in_tools_file(endpoint, context);
  const work::Identification found = swept.identification.value_or(work::Identification());
  const catalogue::Identity& identity = found.identity;
  const bool has_unit = swept.unit.has_value();
  // The table of an earlier map does not name a later tool.
  const bool is_later = found.profile.empty() && found.generation == catalogue::Generation::later;
  const std::string model = is_later ? std::string() : identity.tool_model;
  report::Record record{
      .type = "discovered",
      .target = name.empty() ? endpoint : name,
      .time = context.clock.wall(),
      .fields = {{"found_by", std::string("sweep")},
                 {"endpoint", endpoint},
                 {"address", swept.address},
                 {"port", number(swept.port)},
                 {"unit", has_unit ? number(swept.unit->value) : Cell()},
                 {"serial", text_or_null(identity.serial)},
                 {"model", text_or_null(model), swept.identification ? model : "does not say"},
                 {"tool_type", text_or_null(found.series)},
                 {"tool_type_code", number_or_null(identity.tool_model_code)},
                 {"firmware", number_or_null(identity.firmware)},
                 {"mac", Cell()},
                 {"in_use", Cell()},
                 {"profile", text_or_null(found.profile)},
                 {"name", text_or_null(name)},
                 {"from", swept.address},
                 {"interface", Cell()}}};
  return {std::move(record), endpoint, identity.serial, found.profile, found.profile, name};
}

}  // namespace spindle::commands
