//! Song time and beats, piecewise linear: a few constant tempos, one after the other.

/// A beat and when it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    pub beat: f64,
    pub seconds: f64,
}

/// Where beats are in time. Before the first node and after the last, the tempo goes on.
#[derive(Clone, Debug)]
pub(crate) struct TempoMap {
    /// At least two, both fields rising. Between two nodes the tempo is constant.
    nodes: Vec<Node>,
}

impl TempoMap {
    /// `None` unless there are two nodes and time rises with beats.
    pub(crate) fn new(nodes: Vec<Node>) -> Option<Self> {
        let rises = nodes.windows(2).all(|pair| pair[1].beat > pair[0].beat && pair[1].seconds > pair[0].seconds);
        (nodes.len() > 1 && rises).then_some(Self { nodes })
    }

    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Time in seconds of a beat.
    pub(crate) fn seconds_at(&self, beat: f64) -> f64 {
        let [a, b] = self.around(|node| node.beat <= beat);
        a.seconds + (beat - a.beat) * (b.seconds - a.seconds) / (b.beat - a.beat)
    }

    /// Beat at a time in seconds.
    pub(crate) fn beat_at(&self, seconds: f64) -> f64 {
        let [a, b] = self.around(|node| node.seconds <= seconds);
        a.beat + (seconds - a.seconds) * (b.beat - a.beat) / (b.seconds - a.seconds)
    }

    /// Tempos in beats per minute, each with the beat at which it begins.
    pub(crate) fn tempos(&self) -> impl Iterator<Item = (f64, f64)> {
        self.nodes.windows(2).map(|pair| (pair[0].beat, bpm(pair[0], pair[1])))
    }

    /// The same map with this many beats taken off each beat's number.
    pub(crate) fn renumbered(&self, offset: f64) -> Self {
        let nodes = self.nodes.iter().map(|node| Node { beat: node.beat - offset, ..*node }).collect();
        Self { nodes }
    }

    fn around(&self, is_past: impl Fn(&Node) -> bool) -> [Node; 2] {
        let next = self.nodes.partition_point(is_past).clamp(1, self.nodes.len() - 1);
        [self.nodes[next - 1], self.nodes[next]]
    }
}

/// Tempo between two nodes in beats per minute.
pub(crate) fn bpm(from: Node, to: Node) -> f64 {
    60.0 * (to.beat - from.beat) / (to.seconds - from.seconds)
}
