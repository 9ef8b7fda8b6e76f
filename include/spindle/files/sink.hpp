#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/enum_table.hpp"
#include "spindle/base/error.hpp"
#include "spindle/files/finding.hpp"

namespace spindle::files {

/// Which events of the tools a sink gets. Gaps it gets always.
enum class SinkEvents : std::uint8_t { results, all };
inline constexpr auto sink_events_words =
    enum_table<SinkEvents>({{"results", SinkEvents::results}, {"all", SinkEvents::all}});

enum class SinkKind : std::uint8_t { mqtt, postgresql };
inline constexpr auto sink_kind_words =
    enum_table<SinkKind>({{"mqtt", SinkKind::mqtt}, {"postgresql", SinkKind::postgresql}});

/// A sink's URL, taken apart.
struct SinkUrl {
  SinkKind kind = SinkKind::mqtt;
  std::string text = {};  ///< as it was given
  // The rest is of MQTT only: libpq reads the others by itself.
  bool is_encrypted = false;  ///< mqtts
  std::string host = {};      ///< name or address without brackets
  std::uint16_t port = 0;     ///< filled in where the URL has none: 8883 and 1883
  std::string base = {};      ///< first levels of every topic; "spindle/v1" where the URL has none
};

/// Whether the text begins as the URL of a sink.
bool names_sink(std::string_view text);

/// Parses mqtt://HOST[:PORT][/BASE/TOPIC], the same with mqtts, and what begins with postgresql://
/// or postgres://. Error `bad_target`: an unknown scheme, no host, a port outside 1…65535, a topic
/// that cannot be one (+, #, $ in front, control characters, too long), a password, which may
/// stand in no URL. The message never has it.
Result<SinkUrl> parse_sink_url(std::string_view text);

/// One named sink of the tools file, or one that a URL on the command line describes: where
/// `spindle forward` hands stored results on to. What is empty was not given. Files stand here with
/// the folder of the tools file, where their paths are relative.
struct Sink {
  std::string name;                    ///< of its place in the store
  std::vector<std::string> urls = {};  ///< of one kind; tried in turn; no password
  std::string user = {};
  std::string password_file = {};  ///< its first line is the password
  std::string ca_file = {};        ///< certificates (PEM) of who signs servers
  std::string cert_file = {};      ///< our own certificate (PEM)
  std::string key_file = {};       ///< its private key (PEM)
  std::string collector = {};      ///< what the sink calls this computer; empty: its host name
  std::string client_id = {};      ///< of MQTT; empty: made of collector and name
  std::optional<SinkEvents> events = std::nullopt;
  std::optional<std::size_t> window = std::nullopt;  ///< of MQTT: sent and not acknowledged yet
  std::optional<std::size_t> batch = std::nullopt;   ///< of PostgreSQL: rows of a transaction
  SourceLocation url_at = {};
};

/// The sink that nothing but a URL describes; the URL is its name. Errors: those of
/// parse_sink_url().
Result<Sink> sink_of_url(const std::string& url);

}  // namespace spindle::files
