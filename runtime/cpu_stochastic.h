// Hits that are kept from frame to frame, as in the paper's own method. Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_STOCHASTIC_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_STOCHASTIC_H
#undef TRIMRAY_CPU_STOCHASTIC_H
#else
#define TRIMRAY_CPU_STOCHASTIC_H
#endif

#include "runtime/cpu_write.h"
#include "runtime/stochastic_frames.h"

SHARED_OPEN

FN void load_kept(const KeptPacket& kept, mask alive, PacketHit& hit)
{
    hit.best = select(alive, load(kept.best), hit.best);
    hit.leaf = load(kept.leaf);
    hit.instance = load(kept.instance);
    hit.uv_face = real2(load(kept.u_face), load(kept.v_face));
    hit.normal = real3(load(kept.normal[0]), load(kept.normal[1]), load(kept.normal[2]));
}

/// A pixel changes only where its new hit is nearer than what was kept.
FN void keep_nearer(PacketHit& hit, mask alive, KeptPacket& kept)
{
    PacketHit before = hit;
    load_kept(kept, alive, before);
    const mask nearer = hit.best < before.best;
    hit.best = select(nearer, hit.best, before.best);
    hit.leaf = select(nearer, hit.leaf, before.leaf);
    hit.instance = select(nearer, hit.instance, before.instance);
    hit.uv_face = select(nearer, hit.uv_face, before.uv_face);
    hit.normal = select(nearer, hit.normal, before.normal);
    store(hit.best, kept.best);
    store(hit.leaf, kept.leaf);
    store(hit.instance, kept.instance);
    store(hit.uv_face.x, kept.u_face);
    store(hit.uv_face.y, kept.v_face);
    store(hit.normal.x, kept.normal[0]);
    store(hit.normal.y, kept.normal[1]);
    store(hit.normal.z, kept.normal[2]);
}

SHARED_CLOSE
#endif
