#pragma once

#include <optional>
#include <string>

#include "spindle/commands/commands.hpp"
#include "spindle/files/sink.hpp"
#include "spindle/store/reader.hpp"

namespace spindle::forward {

/// The sink that the command line means: one of the tools file, or the one of a URL. Errors:
/// `unknown_name`, those of URLs, and options that mean nothing to its kind.
Result<files::Sink> find_sink(const commands::ForwardOptions& options, const files::Tools& tools);

/// Its password: the first line of its file, or else of the file of its name in `credentials`, the
/// folder of a service manager; empty where it has neither. Certificates and a private key are
/// only looked at. Error `bad_file`: one of them cannot be read, or all users can read what is a
/// secret.
Result<std::optional<std::string>> read_secrets(const files::Sink& sink,
                                                const std::optional<std::string>& credentials,
                                                const Disk& disk);

/// Where --from sets a sink: before an event of this id, and what else was stored since its time;
/// or before everything of this time or later.
Result<store::Positions> positions_from(const std::string& text, store::Reader& reader,
                                        const Clock& clock);

}  // namespace spindle::forward
