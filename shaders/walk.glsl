// A ray through the top tree and the parts' trees, nearest child first.

// A child that waits: its first tau, and its node or leaf
struct Waiting {
    float tau;
    uint item;
};

Waiting waiting_child(BvhNode node, NodeRay ray, TreeRay tree_ray, int child, float tau_max)
{
    ChildHit hit = child_hit(node, ray, child, -tree_ray.anchor, tau_max - tree_ray.anchor);
    bool exists = node.child[child] != kBvhEmpty;
    return Waiting(exists && hit.hit ? hit.near + tree_ray.anchor : kHuge, node.child[child]);
}

void nearer_first(inout Waiting a, inout Waiting b)
{
    if (b.tau < a.tau) {
        Waiting c = a;
        a = b;
        b = c;
    }
}

Waiting stack[stack_size];
uint stack_top = 0u;

void push(Waiting waiting)
{
    if (waiting.tau < kHuge) {
        stack[stack_top] = waiting;
        ++stack_top;
    }
}

void push_children(BvhNode node, TreeRay tree_ray, float tau_max)
{
    NodeRay ray = node_ray(node, tree_ray.origin, tree_ray.inverse);
    Waiting a = waiting_child(node, ray, tree_ray, 0, tau_max);
    Waiting b = waiting_child(node, ray, tree_ray, 1, tau_max);
    Waiting c = waiting_child(node, ray, tree_ray, 2, tau_max);
    Waiting d = waiting_child(node, ray, tree_ray, 3, tau_max);
    nearer_first(a, b); // a sorting network of five comparisons
    nearer_first(c, d);
    nearer_first(a, c);
    nearer_first(b, d);
    nearer_first(b, c);
    push(d);
    push(c);
    push(b);
    push(a);
    ++node_visits;
}

// No hit can be nearer than what begins beyond this: the nearest so far, and the rounding of a distance
float hit_tau(Hit hit)
{
    float tau = tau_of(hit.past);
    return hit.past < kHuge ? tau + max(4.0f * kRounding * abs(tau), hit.slack) : kHuge;
}

// A leaf of an instance; kNoLeaf: none
struct Guess {
    uint leaf;
    uint instance;
};

// Whether any hit ends a walk; then what lets light through is no hit
bool any_hit = false;

bool lets_light_through(uint leaf, uint instance)
{
    if (!has_feature(kFeatureLayers) || !any_hit)
        return false;
    return material_of(patches[leaves[leaf].patch].face, instance).opacity < 1.0f;
}

// Walks the trees until nothing nearer can wait; the guess is searched before all others, and only then. Returns false
// where the driver's loop limit would have cut it short.
bool walk(Ray whole_ray, Guess guess, inout Hit hit)
{
    const uint kNoPart = 0xffffffffu;
    uint part_floor = kNoPart; // what the stack holds below is the top tree's
    uint instance_index = 0u;
    FrameInstance instance;
    TreeRay ray = top_ray(whole_ray);
    stack_top = 0u;
    push(Waiting(0.0f, 0u));
    bool guess_waits = has_feature(kFeatureReuse) && guess.leaf != kNoLeaf;
    if (guess_waits)
        push(Waiting(0.0f, kBvhLeaf | guess.instance));
    while (stack_top > 0u) {
        iterations = 1u;
        if (part_floor != kNoPart && stack_top == part_floor) {
            part_floor = kNoPart;
            ray = top_ray(whole_ray);
        }
        --stack_top;
        Waiting next = stack[stack_top];
        float tau_max = hit_tau(hit);
        if (next.tau <= tau_max) {
            uint index = next.item & ~kBvhLeaf;
            bool is_leaf = (next.item & kBvhLeaf) != 0u;
            bool in_part = part_floor != kNoPart;
            if (!is_leaf) {
                if (in_part)
                    push_children(part_nodes[instance.first_node + index], ray, tau_max);
                else
                    push_children(top_nodes[index], ray, tau_max);
            } else if (!in_part) {
                instance_index = index;
                instance = instances[index];
                ray = part_ray(instance, instance_index, whole_ray);
                part_floor = stack_top;
                push(Waiting(next.tau, guess_waits ? kBvhLeaf | (guess.leaf - instance.first_leaf) : 0u));
            } else {
                uint leaf = instance.first_leaf + index;
                bool is_guess = has_feature(kFeatureReuse) && leaf == guess.leaf && instance_index == guess.instance;
                if ((!is_guess || guess_waits) && !lets_light_through(leaf, instance_index))
                    leaf_hit(leaf, instance_index, instance, whole_ray, hit);
                guess_waits = false;
                if (any_hit && hit.leaf != kNoLeaf)
                    return true;
            }
        }
        if (iteration_limit > 0u) {
            group_iterations += subgroupMax(iterations);
            if (group_iterations > iteration_limit || overrun)
                return false;
        }
    }
    return true;
}
