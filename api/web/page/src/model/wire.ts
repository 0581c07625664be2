// Between the messages of the contract and plain numbers.
import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { DurationSchema, TimestampSchema, type Duration, type Timestamp } from '@bufbuild/protobuf/wkt';
import type { AxisState } from '@proto/types_pb';
import { StatusDetailsSchema, ErrorDetailSchema, type ErrorDetail } from '@proto/error_pb';
import { fromBinary } from '@bufbuild/protobuf';
import type { Sample } from './series';

export function milliseconds(duration: Duration | undefined): number | null {
  return duration === undefined ? null : Number(duration.seconds) * 1000 + duration.nanos / 1e6;
}

export function duration(ms: number): MessageInitShape<typeof DurationSchema> {
  const seconds = Math.trunc(ms / 1000);
  return create(DurationSchema, { seconds: BigInt(seconds), nanos: Math.round((ms - seconds * 1000) * 1e6) });
}

/** Milliseconds since 1970. */
export function instant(timestamp: Timestamp | undefined): number | null {
  return timestamp === undefined ? null : Number(timestamp.seconds) * 1000 + timestamp.nanos / 1e6;
}

export function timestamp(at: number): MessageInitShape<typeof TimestampSchema> {
  const seconds = Math.floor(at / 1000);
  return create(TimestampSchema, { seconds: BigInt(seconds), nanos: Math.floor((at - seconds * 1000) * 1e6) });
}

/** What the scope keeps of a state; null: the drive was never read. */
export function sampleOf(state: AxisState): Sample | null {
  const at = instant(state.measuredAt);
  if (at === null) return null;
  let terminals = 0;
  [...state.inputs, ...state.outputs].slice(0, 32).forEach(({ active }, index) => { if (active) terminals |= 1 << index; });
  return { at, position: state.position, velocity: state.velocity, target: state.target ?? NaN,
           error: state.followingError ?? NaN, moving: state.moving, state: state.state, terminals: terminals >>> 0 };
}

/** The detail in a google.rpc.Status; null: there is none. */
export function detailOf(status: Uint8Array): ErrorDetail | null {
  if (status.length === 0) return null;
  try {
    const packed = fromBinary(StatusDetailsSchema, status).details.find(({ typeUrl }) => typeUrl.endsWith('/axisd.v1.ErrorDetail'));
    return packed === undefined ? null : fromBinary(ErrorDetailSchema, packed.value);
  } catch {
    return null;
  }
}
