"""Small schedules as the three programs write them, and a design to tie them to."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from asbuilt_bim.bim.model import BimModel, Task

COLUMN, WALL = "1ColumnGlobalId0000001", "1WallGlobalId000000001"
TASK_A, TASK_B = "2TaskAGlobalId00000001", "2TaskBGlobalId00000001"

MSP = """<?xml version="1.0" encoding="UTF-8"?>
<Project xmlns="http://schemas.microsoft.com/project"><Name>P</Name><CalendarUID>1</CalendarUID>
<Calendars>
 <Calendar><UID>1</UID><Name>Site</Name><IsBaseCalendar>1</IsBaseCalendar><BaseCalendarUID>-1</BaseCalendarUID><WeekDays>
  <WeekDay><DayType>1</DayType><DayWorking>0</DayWorking></WeekDay>
  <WeekDay><DayType>2</DayType><DayWorking>1</DayWorking><WorkingTimes><WorkingTime>
   <FromTime>07:00:00</FromTime><ToTime>15:00:00</ToTime></WorkingTime></WorkingTimes></WeekDay>
  <WeekDay><DayType>0</DayType><DayWorking>0</DayWorking><TimePeriod>
   <FromDate>2026-03-04T00:00:00</FromDate><ToDate>2026-03-05T23:59:00</ToDate></TimePeriod></WeekDay>
 </WeekDays></Calendar></Calendars>
<Tasks>
 <Task><UID>0</UID><ID>0</ID><Name>P</Name><OutlineLevel>0</OutlineLevel></Task>
 <Task><UID>10</UID><ID>1</ID><Name>Ground floor</Name><OutlineLevel>1</OutlineLevel><Summary>1</Summary></Task>
 <Task><UID>11</UID><ID>2</ID><Name>Columns</Name><WBS>1.1</WBS><OutlineLevel>2</OutlineLevel>
  <Start>2026-03-09T08:00:00</Start><Finish>2026-03-20T17:00:00</Finish>
  <Baseline><Number>0</Number><Start>2026-03-02T08:00:00</Start><Finish>2026-03-13T17:00:00</Finish></Baseline></Task>
 <Task><UID>12</UID><ID>3</ID><Name>Walls</Name><WBS>1.2</WBS><OutlineLevel>2</OutlineLevel>
  <Start>2026-03-16T08:00:00</Start><Finish>2026-03-27T17:00:00</Finish>
  <PredecessorLink><PredecessorUID>11</PredecessorUID><Type>3</Type><LinkLag>4800</LinkLag><LagFormat>7</LagFormat>
  </PredecessorLink></Task>
 <Task><UID>13</UID><ID>4</ID><Name>Painting</Name><OutlineLevel>1</OutlineLevel><Start>2026-04-01T08:00:00</Start>
  <Finish>2026-04-08T17:00:00</Finish></Task>
 <Task><UID>14</UID><ID>5</ID><IsNull>1</IsNull></Task>
</Tasks></Project>
"""

P6 = """<?xml version="1.0" encoding="UTF-8"?>
<APIBusinessObjects xmlns="http://xmlns.oracle.com/Primavera/P6/V8.4/API/BusinessObjects">
<Calendar><HoursPerDay>8</HoursPerDay><Name>Five days</Name><ObjectId>7</ObjectId><StandardWorkWeek>
 <StandardWorkHours><DayOfWeek>Monday</DayOfWeek><WorkTime><Start>08:00:00</Start><Finish>11:59:00</Finish></WorkTime>
 <WorkTime><Start>13:00:00</Start><Finish>16:59:00</Finish></WorkTime></StandardWorkHours>
 <StandardWorkHours><DayOfWeek>Sunday</DayOfWeek></StandardWorkHours></StandardWorkWeek>
 <HolidayOrExceptions><HolidayOrException><Date>2026-04-06T00:00:00</Date><WorkTime></WorkTime></HolidayOrException>
 </HolidayOrExceptions></Calendar>
<Project><ActivityDefaultCalendarObjectId>7</ActivityDefaultCalendarObjectId><Id>P</Id><ObjectId>1</ObjectId>
 <WBS><Code>G</Code><Name>Ground floor</Name><ObjectId>5</ObjectId></WBS>
 <WBS><Code>C</Code><Name>Columns of it</Name><ObjectId>6</ObjectId><ParentObjectId>5</ParentObjectId></WBS>
 <Activity><Id>A1000</Id><Name>Columns</Name><ObjectId>100</ObjectId><PlannedFinishDate>2026-03-13T17:00:00</PlannedFinishDate>
  <PlannedStartDate>2026-03-02T08:00:00</PlannedStartDate><Type>Task Dependent</Type><WBSObjectId>6</WBSObjectId>
  <UDF><TypeObjectId>1</TypeObjectId><TextValue>ifc 2TaskAGlobalId00000001</TextValue></UDF></Activity>
 <Activity><Id>A1010</Id><Name>Something else</Name><ObjectId>101</ObjectId>
  <PlannedFinishDate>2026-03-27T17:00:00</PlannedFinishDate><PlannedStartDate>2026-03-16T08:00:00</PlannedStartDate>
  <Type>Task Dependent</Type><WBSObjectId>5</WBSObjectId></Activity>
 <Activity><Id>A1020</Id><Name>Supervision</Name><ObjectId>102</ObjectId><Type>Level of Effort</Type></Activity>
 <Relationship><Lag>8</Lag><PredecessorActivityObjectId>100</PredecessorActivityObjectId>
  <SuccessorActivityObjectId>101</SuccessorActivityObjectId><Type>Finish to Start</Type></Relationship>
</Project></APIBusinessObjects>
"""


def written(folder: Path, text: str, name: str = "planning.xml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def task(key: str, name: str, identification: str = "", elements: tuple[str, ...] = (COLUMN,)) -> Task:
    return Task(
        global_id=key,
        name=name,
        identification=identification,
        elements=elements,
        schedule_start=datetime(2025, 1, 1),
        schedule_finish=datetime(2025, 1, 2),
    )


def design(*tasks: Task, elements: tuple[str, ...] = (COLUMN, WALL)) -> BimModel:
    """A design of which only tasks and GlobalIds matter."""
    return BimModel(
        file_name="design.ifc",
        file_digest="",
        schema="IFC4",
        project_name="P",
        storeys=(),
        elements=tuple(_Element(key) for key in elements),  # type: ignore[misc]
        obstacles=(),
        tasks=tasks,
        cost_lines=(),
        notes=(),
    )


class _Element:
    def __init__(self, global_id: str) -> None:
        self.global_id = global_id
