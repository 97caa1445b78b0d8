// The messages from a worker to its supervisor: type, length, bytes. Written whole, read in pieces.
#pragma once

#include <cerrno>
#include <cstdint>
#include <string_view>
#include <unistd.h>

namespace trimray {

enum class MessageType : char { Phase = 'P', Note = 'N', Signal = 'S', Frames = 'F', Value = 'V', Error = 'E' };

struct MessageHeader {
    MessageType type = MessageType::Phase;
    uint64_t size = 0;
};

/// False when nobody reads any more. Safe in a signal handler.
inline bool send_message(int descriptor, MessageType type, std::string_view payload)
{
    MessageHeader header;
    header.type = type;
    header.size = payload.size();
    for (std::string_view left : {std::string_view(reinterpret_cast<const char*>(&header), sizeof header), payload})
        while (!left.empty()) {
            const ssize_t written = write(descriptor, left.data(), left.size());
            if (written < 0 && errno == EINTR)
                continue;
            if (written <= 0)
                return false;
            left.remove_prefix(static_cast<size_t>(written));
        }
    return true;
}

} // namespace trimray
