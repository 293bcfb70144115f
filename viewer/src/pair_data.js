// The pair that the page shows, from the JSON that viewer/view_data.cpp wrote.

function bytes(base64) {
  const text = atob(base64);
  const result = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) result[i] = text.charCodeAt(i);
  return result.buffer;
}

const floats = (base64) => new Float32Array(bytes(base64));

function readExplanation(e) {
  if (e === null) return null;
  const described = (d) => ({ xyz: floats(d.xyz), significance: floats(d.significance) });
  return {
    source: described(e.source),
    target: described(e.target),
    matches: { ends: new Uint32Array(bytes(e.matches.ends)), weight: floats(e.matches.weight) },
    hypotheses: e.hypotheses,
  };
}

const same = (a, b) => a.every((value, i) => value === b[i]);

/// What the list of poses offers: {pose, score, kind}, the answer first; none without an answer.
function listPoses(result, explanation) {
  if (result.pose === null) return [];
  const answer = { pose: result.pose, score: result.score, kind: "answer" };
  const alternatives = result.alternatives.map((a) => ({ ...a, kind: "alternative" }));
  const poses = [answer, ...alternatives];
  for (const h of explanation?.hypotheses ?? []) {
    if (!poses.some((p) => same(p.pose, h.pose))) poses.push({ ...h, kind: "hypothesis" });
  }
  const isCoarse = (p) => same(p.pose, result.coarse_pose);
  const identity = result.coarse_pose.every((v, i) => v === (i % 5 === 0 ? 1 : 0));
  const coarse = poses.find(isCoarse);
  if (coarse !== undefined && coarse !== answer) coarse.kind = "coarse";
  if (coarse === undefined && !identity) {
    poses.push({ pose: result.coarse_pose, score: null, kind: "coarse" });
  }
  const rank = (p) => (p === answer ? Infinity : (p.score ?? -Infinity));
  return poses.sort((a, b) => rank(b) - rank(a) || 0);
}

/// Reads the text of the page's data element.
export function readPair(text) {
  const data = JSON.parse(text);
  const explanation = readExplanation(data.explanation);
  const cloud = (c) => ({ ...c, xyz: floats(c.xyz) });
  return {
    ...data,
    source: cloud(data.source),
    target: cloud(data.target),
    explanation,
    poses: listPoses(data.result, explanation),
  };
}
