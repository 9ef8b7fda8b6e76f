#include "spindle/work/tool_memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::work {
namespace {

constexpr std::string_view head = "spindle tools seen 1";
constexpr std::size_t most_tools = 500;
constexpr std::size_t longest_field = 255;

/// A field of a line: nothing that could be taken for the end of it, or would show otherwise.
bool is_field(std::string_view text) {
  return text.size() <= longest_field &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7f'; });
}

std::string line_of(const SeenTool& tool) {
  return fmt::format("{}\t{}\t{}\t{}\t{}\n", tool.host,
                     tool.unit ? std::to_string(*tool.unit) : std::string(), tool.port,
                     tool.profile, tool.serial);
}

std::optional<SeenTool> tool_of(std::string_view line) {
  constexpr std::size_t fields = 5;
  const auto parts = split(line, '\t');
  if (parts.size() != fields || !std::all_of(parts.begin(), parts.end(), is_field)) {
    return std::nullopt;
  }
  SeenTool tool{.host = std::string(parts[0]),
                .profile = std::string(parts[3]),
                .serial = std::string(parts[4])};
  const auto port = parse_unsigned(parts[2], std::numeric_limits<std::uint16_t>::max());
  const auto unit = parse_unsigned(parts[1], std::numeric_limits<std::uint8_t>::max());
  const bool is_whole = !tool.host.empty() && !tool.profile.empty() && !tool.serial.empty();
  if (!is_whole || !port || *port == 0 || (!parts[1].empty() && !unit)) return std::nullopt;
  tool.port = static_cast<std::uint16_t>(*port);
  if (unit) tool.unit = static_cast<std::uint8_t>(*unit);
  return tool;
}

bool is_at(const SeenTool& tool, const SeenTool& other) {
  return tool.host == other.host && tool.unit == other.unit && tool.port == other.port;
}

Error broken(const std::string& path) {
  return {.code = Errc::bad_file, .message = "is no list of tools that were seen", .name = path};
}

}  // namespace

bool has_one_port(const std::vector<SeenTool>& seen) {
  return std::all_of(seen.begin(), seen.end(),
                     [&](const SeenTool& tool) { return tool.port == seen.front().port; });
}

std::string ToolMemory::path() const { return folder_.empty() ? folder_ : folder_ + "/tools-seen"; }

Result<std::vector<SeenTool>> ToolMemory::read() const {
  std::vector<SeenTool> tools;
  if (folder_.empty() || disk_->absent(path())) return tools;
  TRY_LET(const auto text, disk_->read_trusted(path()));
  std::vector<std::string_view> lines = split(text, '\n');
  const bool is_ours = lines.size() >= 2 && lines.front() == head && lines.back().empty() &&
                       lines.size() <= most_tools + 2;
  if (!is_ours) return tl::unexpected(broken(path()));
  for (std::size_t at = 1; at + 1 < lines.size(); ++at) {
    auto tool = tool_of(lines[at]);
    if (!tool) return tl::unexpected(broken(path()));
    tools.push_back(std::move(*tool));
  }
  return tools;
}

Result<void> ToolMemory::write(const std::vector<SeenTool>& tools) const {
  std::string text = fmt::format("{}\n", head);
  const std::size_t left_out = tools.size() > most_tools ? tools.size() - most_tools : 0;
  for (std::size_t at = left_out; at < tools.size(); ++at) text += line_of(tools[at]);
  TRY(disk_->make_folders(folder_, Privacy::own));
  return disk_->write(path(), text, Overwrite::allow, Privacy::own);
}

Result<std::optional<SeenTool>> ToolMemory::recall(const link::Endpoint& endpoint) const {
  TRY_LET(const auto tools, read());
  const auto is_meant = [&](const SeenTool& tool) {
    const bool has_unit = endpoint.unit.has_value() == tool.unit.has_value() &&
                          (!tool.unit || endpoint.unit->value == *tool.unit);
    return tool.host == endpoint.host && has_unit &&
           (!endpoint.port || *endpoint.port == tool.port);
  };
  const auto newest = std::find_if(tools.rbegin(), tools.rend(), is_meant);
  return newest == tools.rend() ? std::nullopt : std::optional(*newest);
}

Result<std::vector<SeenTool>> ToolMemory::seen_behind(const link::Endpoint& endpoint) const {
  TRY_LET(auto tools, read());
  std::erase_if(tools, [&](const SeenTool& tool) { return tool.host != endpoint.host; });
  return tools;
}

/// A file that is broken is made anew; one of another user is left alone.
Result<void> ToolMemory::remember(const SeenTool& tool) const {
  const bool is_fit = is_field(tool.host) && is_field(tool.profile) && is_field(tool.serial) &&
                      !tool.host.empty() && !tool.profile.empty() && !tool.serial.empty();
  if (folder_.empty() || !is_fit) return {};
  auto known = read();
  if (!known && known.error().message != broken(path()).message) {
    return tl::unexpected(std::move(known.error()));
  }
  std::vector<SeenTool> tools = known ? std::move(*known) : std::vector<SeenTool>();
  if (!tools.empty() && tools.back() == tool) return {};
  std::erase_if(tools, [&](const SeenTool& other) { return is_at(other, tool); });
  tools.push_back(tool);
  return write(tools);
}

Result<void> ToolMemory::forget(const SeenTool& tool) const {
  TRY_LET(auto tools, read());
  if (std::erase(tools, tool) == 0) return {};
  return write(tools);
}

}  // namespace spindle::work
