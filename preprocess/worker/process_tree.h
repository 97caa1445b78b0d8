// A process with all that it started, as /proc shows them: what limits are held against, and what is ended with it.
#pragma once

#include <cstdint>
#include <map>
#include <sys/types.h>
#include <vector>

namespace trimray {

/// All processes of the machine at one moment, by their parents.
class ProcessTable {
public:
    static ProcessTable read();

    /// The processes that `parent` started and that live, or that nobody has waited for.
    std::vector<pid_t> children_of(pid_t parent) const;

    /// `root` and all below it, parents first.
    std::vector<pid_t> tree_of(pid_t root) const;

private:
    std::multimap<pid_t, pid_t> children_; // by parent
};

/// Memory of a process that is resident; 0 when it is gone.
uint64_t resident_bytes(pid_t pid);

/// What a process has written to files, pipes and sockets, and those of its children that it has waited for; 0 when it
/// is gone.
uint64_t written_bytes(pid_t pid);

/// Makes this process the one that orphans below it fall to, so that none can escape by leaving its parent (Linux).
void adopt_orphans();

/// Ends every child of this process that is not among `known`, with all below it, and waits for them: orphans of
/// workers that are gone. Returns how many there were. Call it in a process that adopts orphans and has no other
/// children.
int end_orphans(const std::vector<pid_t>& known);

} // namespace trimray
