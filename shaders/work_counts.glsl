// Sums of what invocations did, over a frame.

// Adds a subgroup's sum to a count of two words
void tally(uint count, uint amount)
{
    uint sum = subgroupAdd(amount);
    if (subgroupElect() && sum > 0u) {
        uint before = atomicAdd(counts[2u * count], sum);
        if (before + sum < before)
            atomicAdd(counts[2u * count + 1u], 1u);
    }
}
